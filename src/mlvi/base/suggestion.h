// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mlvi {

// The end of a message about an unknown word: "; did you mean 'NAME'?" with the nearest candidate
// (NearestName), or "" when none is near.
std::string DidYouMean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace mlvi
