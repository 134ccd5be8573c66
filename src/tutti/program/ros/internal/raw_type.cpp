// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/internal/raw_type.hpp"

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>

namespace tutti::ros::internal {
namespace {

constexpr std::size_t kAlignment = 4;  // of a packet's parts: Cyclone sends others, and takes them for malformed

struct RawType final : ddsi_sertype {};

struct RawData final : ddsi_serdata {
  RawData(const ddsi_sertype* of, ddsi_serdata_kind data_kind, std::size_t size)
      : ddsi_serdata{}, bytes((size + kAlignment - 1) / kAlignment * kAlignment, '\0') {
    ddsi_serdata_init(this, of, data_kind);
    hash = of->serdata_basehash;
  }
  std::string bytes;
};

const RawData& raw(const ddsi_serdata* data) { return *static_cast<const RawData*>(data); }

/// Topics have no key: this is all of it.
ddsi_serdata* no_data(const ddsi_sertype* type) { return new RawData(type, SDK_KEY, 0); }

bool is_taken(std::size_t size) { return size >= kHeaderBytes && size <= kMaxMessageBytes; }

/// Joins a message that came from the network in parts, which may overlap. Cyclone drops it when this is null.
ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* part, std::size_t size) {
  if (kind != SDK_DATA) return no_data(type);
  if (!is_taken(size)) return nullptr;
  auto out = std::make_unique<RawData>(type, kind, size);
  std::size_t done = 0;
  for (; part != nullptr; part = part->nextfrag) {
    const std::size_t end = std::min<std::size_t>(part->maxp1, size);
    if (part->min > done) return nullptr;
    if (end <= done) continue;
    const unsigned char* payload = NN_RMSG_PAYLOADOFF(part->rmsg, NN_RDATA_PAYLOAD_OFF(part));
    std::memcpy(out->bytes.data() + done, payload + (done - part->min), end - done);
    done = end;
  }
  return done == size ? out.release() : nullptr;
}

ddsi_serdata* from_vectors(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                           const ddsrt_iovec_t* parts, std::size_t size) {
  if (kind != SDK_DATA) return no_data(type);
  if (!is_taken(size)) return nullptr;
  auto out = std::make_unique<RawData>(type, kind, size);
  std::size_t done = 0;
  for (ddsrt_msg_iovlen_t i = 0; i < count && done < size; ++i) {
    const std::size_t length = std::min<std::size_t>(parts[i].iov_len, size - done);
    std::memcpy(out->bytes.data() + done, parts[i].iov_base, length);
    done += length;
  }
  return done == size ? out.release() : nullptr;
}

void to_bytes(const ddsi_serdata* data, std::size_t offset, std::size_t size, void* out) {
  std::memcpy(out, raw(data).bytes.data() + offset, size);
}
ddsi_serdata* to_reference(const ddsi_serdata* data, std::size_t offset, std::size_t size, ddsrt_iovec_t* out) {
  out->iov_base = const_cast<char*>(raw(data).bytes.data()) + offset;  // NOLINT: C's iovec; it is only read
  out->iov_len = size;
  return ddsi_serdata_ref(data);
}

const ddsi_serdata_ops kDataOps = [] {
  ddsi_serdata_ops ops{};
  ops.eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; };
  ops.get_size = [](const ddsi_serdata* data) { return static_cast<std::uint32_t>(raw(data).bytes.size()); };
  ops.from_ser = from_fragments;
  ops.from_ser_iov = from_vectors;
  ops.from_keyhash = [](const ddsi_sertype* type, const ddsi_keyhash*) { return no_data(type); };
  ops.from_sample = [](const ddsi_sertype* type, ddsi_serdata_kind, const void*) { return no_data(type); };
  ops.to_ser = to_bytes;
  ops.to_ser_ref = to_reference;
  ops.to_ser_unref = [](ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); };
  ops.to_sample = [](const ddsi_serdata*, void*, void**, void*) { return false; };
  ops.to_untyped = [](const ddsi_serdata* data) { return no_data(data->type); };
  ops.untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) { return true; };
  ops.free = [](ddsi_serdata* data) { delete static_cast<RawData*>(data); };
  ops.print = [](const ddsi_sertype*, const ddsi_serdata* data, char* out, std::size_t size) {
    return static_cast<std::size_t>(std::snprintf(out, size, "(%zu bytes)", raw(data).bytes.size()));
  };
  ops.get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* out, bool) { *out = {}; };
  return ops;
}();

const ddsi_sertype_ops kTypeOps = [] {
  ddsi_sertype_ops ops{};
  ops.version = ddsi_sertype_v0;
  ops.free = [](ddsi_sertype* type) {
    ddsi_sertype_fini(type);
    delete static_cast<RawType*>(type);
  };
  ops.zero_samples = [](const ddsi_sertype*, void*, std::size_t) {};
  ops.realloc_samples = [](void**, const ddsi_sertype*, void*, std::size_t, std::size_t) {};
  ops.free_samples = [](const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {};
  ops.equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; };  // names are, and that is all there is
  ops.hash = [](const ddsi_sertype*) { return std::uint32_t{0}; };
  return ops;
}();

}  // namespace

ddsi_sertype* make_raw_type(const std::string& dds_type) {
  auto type = std::make_unique<RawType>();
  ddsi_sertype_init_flags(type.get(), dds_type.c_str(), &kTypeOps, &kDataOps, DDSI_SERTYPE_FLAG_TOPICKIND_NO_KEY);
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  return type.release();
}

ddsi_serdata* make_raw_data(const ddsi_sertype* type, std::string_view cdr) {
  auto out = std::make_unique<RawData>(type, SDK_DATA, cdr.size());
  std::ranges::copy(cdr, out->bytes.begin());
  return out.release();
}

std::string_view bytes_of(const ddsi_serdata* data) { return raw(data).bytes; }

}  // namespace tutti::ros::internal
