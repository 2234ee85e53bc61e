// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Files read and written in one piece, and the one error of every writer.
#pragma once

#include <string>
#include <string_view>

#include "mlvi/base/error.h"

namespace mlvi {

// The bytes of a file. A missing one, a folder, or one that cannot be read to its end is an Error
// of kind `kind`.
Expected<std::string> ReadWholeFile(const std::string& path, ErrorKind kind);

// Replaces the file by `bytes`; errors are those of CannotWrite.
Expected<void> WriteWholeFile(const std::string& path, std::string_view bytes);

// What every writer of results reports. Of kind kConfiguration: not the recording but the place
// that was named for the results is of no use.
tl::unexpected<Error> CannotWrite(const std::string& path);

}  // namespace mlvi
