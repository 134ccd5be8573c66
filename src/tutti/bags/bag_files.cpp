// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/bag_files.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "tutti/bags/db3_reader.hpp"
#include "tutti/bags/internal/chunk.hpp"
#include "tutti/bags/internal/packed_file.hpp"
#include "tutti/bags/mcap_reader.hpp"
#include "tutti/bags/ros1_reader.hpp"
#include "tutti/bags/rosbag2_metadata.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/base/file.hpp"
#include "tutti/base/file_kind.hpp"

namespace tutti::bags {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSqliteMagic = "SQLite format 3";
constexpr std::string_view kRos1Magic = "#ROSBAG V";

Result<std::string> first_bytes(const std::string& path) {
  auto file = open_file(path);
  if (!file) return tl::unexpected(file.error());
  std::string bytes(kHeadBytes, '\0');
  file->read(bytes.data(), kHeadBytes);
  bytes.resize(static_cast<std::size_t>(file->gcount()));
  return bytes;
}

template <class Reader>
Result<std::unique_ptr<BagReader>> boxed(Result<Reader> reader) {
  if (!reader) return tl::unexpected(reader.error());
  return std::make_unique<Reader>(std::move(*reader));
}

/// `magic`: its first bytes.
Result<std::unique_ptr<BagReader>> open_plain(const std::string& path, const std::string& magic) {
  if (magic.empty()) return fail(ErrorCode::parse, "{}: is empty (0 bytes), expected a recording", path);
  if (const std::string what = known_otherwise(magic, path, FileUse::recording); !what.empty())
    return fail(ErrorCode::unsupported, "{}: {}", path, what);
  if (magic.starts_with(kSqliteMagic)) return boxed(Db3Reader::open(path));
  if (magic.starts_with(kRos1Magic)) return boxed(Ros1Reader::open(path));
  return boxed(McapReader::open(path));
}

/// By name, and numbers in names by their value: bag_2 is before bag_10.
bool comes_before(const fs::path& a, const fs::path& b) {
  const auto key = [](const std::string& name) {
    std::string out;
    for (std::size_t i = 0; i < name.size();) {
      const std::size_t end = std::min(name.find_first_not_of("0123456789", i), name.size());
      if (end > i) {
        out.append(end - i < 20 ? 20 - (end - i) : 0, '0').append(name, i, end - i);
        i = end;
      } else {
        out += name[i++];
      }
    }
    return out;
  };
  return key(a.filename().string()) < key(b.filename().string());
}

bool is_bag_file(const fs::path& path) {
  const fs::path name = path.extension() == ".zstd" ? path.stem() : path;
  return name.extension() == ".mcap" || name.extension() == ".db3" || name.extension() == ".bag";
}

Result<std::unique_ptr<BagReader>> open_folder(const fs::path& folder) {
  std::vector<fs::path> there;
  std::error_code failure;
  for (fs::directory_iterator at(folder, failure), end; !failure && at != end; at.increment(failure))
    if (is_bag_file(at->path())) there.push_back(at->path());
  if (failure) return fail(ErrorCode::io, "{}: cannot be read: {}", folder.string(), failure.message());
  std::ranges::sort(there, comes_before);
  std::vector<std::string> files, notes;
  std::optional<std::uint64_t> messages;
  const fs::path metadata_file = folder / "metadata.yaml";
  if (fs::exists(metadata_file, failure)) {
    const auto text = read_file(metadata_file.string(), kMaxYamlBytes);
    const auto metadata = text ? parse_rosbag2_metadata(*text, metadata_file.string())
                               : Result<Rosbag2Metadata>(tl::unexpected(text.error()));
    if (metadata) {
      for (const std::string& file : metadata->files) files.push_back((folder / file).string());
      messages = metadata->messages;
      const auto exists = [&](const std::string& file) { return fs::exists(file, failure); };
      const bool is_none_there = !files.empty() && std::ranges::none_of(files, exists);
      if (is_none_there && there.empty())
        return fail(ErrorCode::io,
                    "{}: names {}, which is not there, nor is another .mcap, .db3 or .bag: expected the "
                    "recording's files beside it",
                    metadata_file.string(), fs::path(files.front()).filename().string());
      if (is_none_there) {
        notes.push_back(
            fmt::format("{}: names {}, which is not there (renamed?); the files of the folder are read in "
                        "the order of their names",
                        metadata_file.string(), fs::path(files.front()).filename().string()));
        files.clear();
      }
    } else {
      notes.push_back(metadata.error().message + "; the files of the folder are read in the order of their names");
    }
  } else {
    notes.push_back(
        fmt::format("{}: no metadata.yaml (a recording that was not closed?): the files are read in the "
                    "order of their names",
                    folder.string()));
  }
  if (files.empty())
    for (const fs::path& path : there) files.push_back(path.string());
  else
    for (const fs::path& path : there)
      if (std::ranges::find(files, path.string()) == files.end())
        notes.push_back(fmt::format("{}: is not named by metadata.yaml and not read", path.string()));
  if (files.empty())
    return fail(ErrorCode::io, "{}: a folder without .mcap, .db3 or .bag, expected a bag", folder.string());
  return BagFiles::open(std::move(files), std::move(notes), messages);
}

}  // namespace

Result<std::unique_ptr<BagReader>> open_bag(const std::string& path) {
  std::error_code failure;
  if (fs::is_directory(path, failure)) return open_folder(path);
  return BagFiles::open({path}, {}, std::nullopt);
}

Result<std::unique_ptr<BagReader>> BagFiles::open(std::vector<std::string> files, std::vector<std::string> notes,
                                                  std::optional<std::uint64_t> stated_messages) {
  std::unique_ptr<BagFiles> bag(new BagFiles);
  bag->files_ = std::move(files);
  bag->notes_ = std::move(notes);
  bag->stated_messages_ = stated_messages;
  if (auto ok = bag->enter(0); !ok && bag->files_.size() == 1) return tl::unexpected(ok.error());
  return bag;
}

void BagFiles::leave() {
  if (!reader_) return;
  for (const BagChannel* const channel : reader_->channels()) own(channel);
  for (std::string& note : reader_->notes())
    if (std::ranges::find(notes_, note) == notes_.end()) notes_.push_back(std::move(note));
  of_file_.clear();
  reader_.reset();
}

Status BagFiles::enter(std::size_t file) {
  leave();
  file_ = file;
  const std::string& path = files_[file];
  const auto magic = first_bytes(path);
  if (!magic) return tl::unexpected(magic.error());
  if (magic->starts_with(internal::kZstdMagic)) {
    const auto plain = internal::PackedFile::unpack(path);
    if (!plain) return tl::unexpected(plain.error());
    packed_.insert(file);
    auto reader = open_plain(plain->path(), first_bytes(plain->path()).value_or(""));  // its name goes, the open file
                                                                                       // stays
    if (!reader) return in_context(path, reader.error());
    reader_ = std::move(*reader);
    return {};
  }
  auto reader = open_plain(path, *magic);
  if (!reader) return tl::unexpected(reader.error());
  reader_ = std::move(*reader);
  return {};
}

/// The same for all files.
const BagChannel* BagFiles::own(const BagChannel* channel) {
  const BagChannel*& out = of_file_[channel];
  if (out == nullptr) out = &*channels_.insert(*channel).first;
  return out;
}

Result<std::optional<BagMessage>> BagFiles::taken(BagMessage message) {
  message.channel = own(message.channel);
  message.position.file = static_cast<std::uint32_t>(file_);
  // No CDR begins so: rosbag2 states in metadata.yaml that messages are packed,
  // but that may be missing.
  if (message.channel->message_encoding == "cdr" && message.data.starts_with(internal::kZstdMagic)) {
    auto data = internal::unpack_message(message.data);
    if (!data)
      return in_context(
          fmt::format("{}: {}: message at {}", files_[file_], message.channel->topic, message.position.at),
          data.error());
    messages_packed_ = true;
    unpacked_ = std::move(*data);
    message.data = unpacked_;
  }
  return message;
}

Result<std::optional<BagMessage>> BagFiles::next() {
  while (file_ < files_.size()) {
    if (!reader_) {
      if (auto ok = enter(file_); !ok) {
        ++file_;
        return tl::unexpected(ok.error());
      }
    }
    auto message = reader_->next();
    if (!message) return message;
    if (*message) return taken(**message);
    if (file_ + 1 == files_.size()) return std::nullopt;  // it stays open: whoever reads a bag twice is there
    leave();
    ++file_;
  }
  return std::nullopt;
}

Status BagFiles::seek(const BagPosition& position) {
  if (position.file >= files_.size())
    return fail(ErrorCode::invalid, "file {} of a bag, expected less than {}", position.file, files_.size());
  if (!reader_ || file_ != position.file)
    if (auto ok = enter(position.file); !ok) return ok;
  return reader_->seek(position);
}

std::vector<const BagChannel*> BagFiles::channels() const {
  std::vector<const BagChannel*> out;
  std::set<BagChannel> all = channels_;
  for (const BagChannel& channel : channels_) out.push_back(&channel);
  if (reader_)
    for (const BagChannel* const channel : reader_->channels())
      if (all.insert(*channel).second) out.push_back(channel);
  return out;
}

std::optional<std::uint64_t> BagFiles::stated_messages() const {
  return stated_messages_ || !reader_ || files_.size() > 1 ? stated_messages_ : reader_->stated_messages();
}

std::vector<std::string> BagFiles::notes() const {
  std::vector<std::string> out = notes_;
  if (!reader_) return out;
  for (std::string& note : reader_->notes())
    if (std::ranges::find(out, note) == out.end()) out.push_back(std::move(note));
  return out;
}

std::string BagFiles::storage() const {
  std::string out = reader_ ? reader_->storage() : "";
  if (files_.size() > 1) out = fmt::format("{} files{}{}", files_.size(), out.empty() ? "" : ", the last ", out);
  if (!packed_.empty()) out += ", packed as a whole by zstd";
  if (messages_packed_) out += ", messages packed by zstd";
  return out;
}

}  // namespace tutti::bags
