// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/disk_cloud_store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "tutti/base/check.hpp"
#include "tutti/base/file.hpp"

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

Result<std::shared_ptr<DiskCloudStore>> DiskCloudStore::open(const fs::path& folder, const wire::CloudCodec& codec) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure)
    return fail(ErrorCode::io, "{}: cannot make the folder of clouds: {}", folder.string(), failure.message());
  return std::shared_ptr<DiskCloudStore>(new DiskCloudStore(folder, codec));
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
  if (auto ok = write_file(aside.string(), bytes); !ok) return ok;
  if (auto ok = sync_to_disk(aside); !ok) return ok;
  std::error_code failure;
  fs::rename(aside, file, failure);
  if (failure) return fail(ErrorCode::io, "{}: cannot be renamed: {}", aside.string(), failure.message());
  return sync_to_disk(folder_);
}

Result<std::shared_ptr<const PointCloud>> DiskCloudStore::get(SubmapId id) const {
  const std::string file = file_of(id).string();
  const auto bytes = read_file(file);
  if (!bytes) return in_context("cloud of submap " + to_string(id), bytes.error());
  auto cloud = wire::decode_cloud(*bytes);
  if (!cloud) return in_context(fmt::format("cloud of submap {}: {}", to_string(id), file), cloud.error());
  return cloud;
}

}  // namespace tutti::mission
