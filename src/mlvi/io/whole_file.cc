// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/whole_file.h"

#include <array>
#include <filesystem>
#include <fstream>

namespace mlvi {

Expected<std::string> ReadWholeFile(const std::string& path, ErrorKind kind) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return MakeError(kind, "cannot read '{}': it is a folder; name a file in it", path);
  }
  std::ifstream file(path, std::ios::binary);
  if (!file)
    return MakeError(kind, "cannot open '{}': does the file exist, may you read it?", path);
  std::string bytes;
  std::array<char, 1 << 16> block;
  while (file.read(block.data(), block.size()), file.gcount() > 0) {
    bytes.append(block.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad())
    return MakeError(kind, "cannot read '{}' beyond byte {}: is the medium sound?", path,
                     bytes.size());
  return bytes;
}

Expected<void> WriteWholeFile(const std::string& path, std::string_view bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) return CannotWrite(path);
  return {};
}

tl::unexpected<Error> CannotWrite(const std::string& path) {
  return MakeError(
      ErrorKind::kConfiguration,
      "cannot write '{}': does its folder exist, may you write there, is the disk full?", path);
}

}  // namespace mlvi
