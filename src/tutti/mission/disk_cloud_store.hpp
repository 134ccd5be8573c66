// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <utility>

#include "tutti/server/cloud_store.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::mission {

/// Clouds as files of one folder, "<robot>_<index>.cloud" of session 0 and
/// "<robot>_<session>_<index>.cloud" of others, in the coding of the wire: a cloud that came over the wire
/// with the same CloudCodec comes back to the bit. Files are written aside, brought to disk and renamed, so that what
/// is there is whole, and what put() has taken is there, even when the machine stops.
class DiskCloudStore final : public server::CloudStore {
 public:
  /// Makes the folder if it is missing; clouds that are there already can be got.
  static Result<std::shared_ptr<DiskCloudStore>> open(const std::filesystem::path& folder,
                                                      const wire::CloudCodec& codec);

  Status put(SubmapId id, const std::shared_ptr<const PointCloud>& cloud) override;
  [[nodiscard]] Result<std::shared_ptr<const PointCloud>> get(SubmapId id) const override;

 private:
  DiskCloudStore(std::filesystem::path folder, const wire::CloudCodec& codec)
      : folder_(std::move(folder)), codec_(codec) {}
  [[nodiscard]] std::filesystem::path file_of(SubmapId id) const;

  std::filesystem::path folder_;
  wire::CloudCodec codec_;
};

}  // namespace tutti::mission
