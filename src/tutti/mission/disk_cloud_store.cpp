// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/disk_cloud_store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>

#include "tutti/base/check.hpp"

namespace tutti::mission {
namespace fs = std::filesystem;

namespace {

/// Waits until a file's bytes, or the names in a folder, would outlive a halt of the machine.
Status sync_to_disk(const fs::path& path) {
  const int opened = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const int reason = opened >= 0 && ::fsync(opened) == 0 ? 0 : errno;
  if (opened >= 0) ::close(opened);
  if (reason == 0 || reason == EINVAL) return {};  // EINVAL: the file system has no such thing
  return fail(ErrorCode::io, "{}: cannot be brought to disk: {}", path.string(),
              std::generic_category().message(reason));
}

}  // namespace

Result<std::shared_ptr<DiskCloudStore>> DiskCloudStore::open(const fs::path& folder, const wire::CloudCodec& codec,
                                                             std::size_t kept_in_memory) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure)
    return fail(ErrorCode::io, "{}: cannot make the folder of clouds: {}", folder.string(), failure.message());
  return std::shared_ptr<DiskCloudStore>(new DiskCloudStore(folder, codec, kept_in_memory));
}

fs::path DiskCloudStore::file_of(SubmapId id) const {
  const auto& [robot, session] = id.chain;
  return folder_ / (session == 0 ? fmt::format("{}_{}.cloud", robot.value, id.index)
                                 : fmt::format("{}_{}_{}.cloud", robot.value, session, id.index));
}

Status DiskCloudStore::put(SubmapId id, const std::shared_ptr<const PointCloud>& cloud) {
  TUTTI_CHECK(cloud != nullptr, "submap {} without a cloud", to_string(id));
  if (const Status valid = wire::validate(*cloud); !valid) return valid;
  const std::string bytes = wire::encode(*cloud, codec_);
  const fs::path file = file_of(id);
  fs::path aside = file;
  aside += ".part";
  std::ofstream out(aside, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) return fail(ErrorCode::io, "{}: cannot write {} bytes", aside.string(), bytes.size());
  if (auto ok = sync_to_disk(aside); !ok) return ok;
  std::error_code failure;
  fs::rename(aside, file, failure);
  if (failure) return fail(ErrorCode::io, "{}: cannot be renamed: {}", aside.string(), failure.message());
  if (auto ok = sync_to_disk(folder_); !ok) return ok;
  const auto rounded = wire::decode_cloud(bytes);  // what get() would read
  TUTTI_CHECK(rounded.has_value(), "{}", rounded.error().message);
  remember(id, *rounded);
  return {};
}

Result<std::shared_ptr<const PointCloud>> DiskCloudStore::get(SubmapId id) const {
  {
    const std::lock_guard lock(mutex_);
    if (auto found = recent_.find(id)) return found;
  }
  const fs::path file = file_of(id);
  const std::string what = fmt::format("cloud of submap {}: {}", to_string(id), file.string());
  std::ifstream in(file, std::ios::binary);
  if (!in) return fail(ErrorCode::io, "{}: cannot be opened", what);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  auto cloud = wire::decode_cloud(bytes.view());
  if (!cloud) return in_context(what, cloud.error());
  remember(id, *cloud);
  return cloud;
}

void DiskCloudStore::remember(SubmapId id, std::shared_ptr<const PointCloud> cloud) const {
  const std::lock_guard lock(mutex_);
  recent_.keep(id, std::move(cloud));
}

}  // namespace tutti::mission
