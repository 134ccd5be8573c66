// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/shared_answer.hpp"

#include <httplib.h>
#include <zlib.h>

#include <utility>

#include "tutti/base/check.hpp"

namespace tutti::page {
namespace {

constexpr int kGzip = 31;  // the largest window, with gzip's head
constexpr int kMemory = 8;

std::string gzip_of(const std::string& text) {
  z_stream stream{};
  const int begun = deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip, kMemory, Z_DEFAULT_STRATEGY);
  TUTTI_CHECK(begun == Z_OK, "zlib cannot begin");
  std::string out(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int ended = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  TUTTI_CHECK(ended == Z_STREAM_END, "zlib cannot end");
  out.shrink_to_fit();
  return out;
}

}  // namespace

SharedAnswer::SharedAnswer(std::string text, std::string type)
    : type_(std::move(type)),
      plain_(std::make_shared<const std::string>(std::move(text))),
      gzip_(std::make_shared<const std::string>(gzip_of(*plain_))) {}

void SharedAnswer::give(const Request& request, Response& response) const {
  const bool is_gzip = request.get_header_value("Accept-Encoding").find("gzip") != std::string::npos;
  if (is_gzip) response.set_header("Content-Encoding", "gzip");
  const auto shared = is_gzip ? gzip_ : plain_;
  response.set_content_provider(shared->size(), type_,
                                [shared](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                                  return sink.write(shared->data() + offset, length);
                                });
}

}  // namespace tutti::page
