// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mlvi/spatial/voxel_key.h"

namespace mlvi {

// Maps voxel keys to indices by open addressing with linear probing. Entries are not removed one by
// one: who removes rebuilds (Clear and Insert), which the sliding window of a map does rarely.
class VoxelTable {
 public:
  explicit VoxelTable(std::size_t expected = 1024) { Resize(expected); }

  // The index of `key`, or -1.
  int Find(VoxelKey key) const {
    for (std::size_t slot = Slot(key);; slot = (slot + 1) & mask_) {
      if (entries_[slot].key == key) return entries_[slot].index;
      if (entries_[slot].key.bits() == VoxelKey::kInvalidBits) return -1;
    }
  }

  // The index of `key`; when it is new it gets `next_index`, and `*inserted` tells so.
  int FindOrInsert(VoxelKey key, int next_index, bool* inserted) {
    if (2 * (size_ + 1) > entries_.size()) Grow();
    std::size_t slot = Slot(key);
    for (; entries_[slot].key.bits() != VoxelKey::kInvalidBits; slot = (slot + 1) & mask_) {
      if (entries_[slot].key == key) {
        *inserted = false;
        return entries_[slot].index;
      }
    }
    entries_[slot] = {key, next_index};
    ++size_;
    *inserted = true;
    return next_index;
  }

  void Clear() {
    entries_.assign(entries_.size(), Entry{});
    size_ = 0;
  }
  std::size_t size() const { return size_; }
  std::size_t memory_bytes() const { return entries_.capacity() * sizeof(Entry); }

 private:
  struct Entry {
    VoxelKey key;
    int index = -1;
  };

  std::size_t Slot(VoxelKey key) const { return key.Hash() >> shift_; }
  void Resize(std::size_t expected) {
    std::size_t capacity = 16;
    shift_ = 60;
    for (; capacity < 2 * expected; capacity *= 2) --shift_;
    mask_ = capacity - 1;
    entries_.assign(capacity, Entry{});
    size_ = 0;
  }
  void Grow() {
    std::vector<Entry> old = std::move(entries_);
    Resize(old.size());
    bool inserted = false;
    for (const Entry& entry : old) {
      if (entry.key.bits() != VoxelKey::kInvalidBits)
        FindOrInsert(entry.key, entry.index, &inserted);
    }
  }

  std::vector<Entry> entries_;
  std::size_t mask_ = 0;
  std::size_t size_ = 0;
  int shift_ = 60;
};

}  // namespace mlvi
