// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/track_store.h"

#include <gtest/gtest.h>

namespace mlvi {
namespace {

PanoramicObservation At(double x, int camera = 0) {
  PanoramicObservation observation;
  observation.camera = camera;
  observation.pixel = {x, 0.0};
  return observation;
}

TEST(TrackStore, KeepsEndedTracksUntilTheirFramesAreForgotten) {
  TrackStore store;
  const TrackId a = store.Start(FrameId(1), At(1.0));
  store.Extend(a, FrameId(2), At(2.0));
  const TrackId b = store.Start(FrameId(2), At(3.0));
  store.End(a);
  EXPECT_EQ(store.alive(), 1);
  ASSERT_NE(store.Find(a), nullptr);
  EXPECT_FALSE(store.Find(a)->alive);
  store.ForgetBefore(FrameId(2));
  ASSERT_NE(store.Find(a), nullptr);
  EXPECT_EQ(store.Find(a)->observations.size(), 1U);
  EXPECT_EQ(store.Find(a)->last().pixel.x(), 2.0);
  store.ForgetFrame(FrameId(2));
  EXPECT_EQ(store.Find(a), nullptr);
  EXPECT_EQ(store.Find(b), nullptr);
  EXPECT_TRUE(store.tracks().empty());
  EXPECT_GT(store.Start(FrameId(3), At(0.0)), b);  // ids are never used again
}

TEST(TrackStore, ATrialEndsOnceInTheNewestFrame) {
  TrackStore store;
  EXPECT_EQ(store.Find(store.Start(FrameId(1), At(1.0)))->trusted_since, FrameId(1));
  const TrackId a = store.Start(FrameId(1), At(1.0), /*on_trial=*/true);
  EXPECT_FALSE(store.Find(a)->trusted());
  store.Extend(a, FrameId(2), At(2.0));
  EXPECT_THROW(store.Trust(a, FrameId(1)), ContractViolation);
  store.Trust(a, FrameId(2));
  EXPECT_EQ(store.Find(a)->trusted_since, FrameId(2));
  EXPECT_THROW(store.Trust(a, FrameId(2)), ContractViolation);
}

TEST(TrackStore, ForgettingAFrameInTheMiddleLeavesTheRest) {
  TrackStore store;
  const TrackId a = store.Start(FrameId(1), At(1.0));
  store.Extend(a, FrameId(2), At(2.0));
  store.Extend(a, FrameId(3), At(3.0));
  store.ForgetFrame(FrameId(2));
  EXPECT_EQ(store.Find(a)->frames(), 2);
  EXPECT_TRUE(store.Find(a)->alive);
  store.Extend(a, FrameId(4), At(4.0));
  EXPECT_EQ(store.Find(a)->last_frame(), FrameId(4));
}

TEST(TrackStore, CountsAFrameOfTwoCamerasOnce) {
  TrackStore store;
  const TrackId a = store.Start(FrameId(1), At(1.0, 0));
  store.Extend(a, FrameId(1), At(9.0, 1));
  store.Extend(a, FrameId(2), At(2.0, 0));
  EXPECT_EQ(store.Find(a)->frames(), 2);
  EXPECT_EQ(store.Find(a)->observations.size(), 3U);
}

TEST(TrackStore, RejectedObservationsAreTakenBack) {
  TrackStore store;
  const TrackId a = store.Start(FrameId(1), At(1.0));
  const TrackId b = store.Start(FrameId(1), At(5.0));
  store.Extend(b, FrameId(2), At(6.0));
  store.RejectLast(a);
  store.RejectLast(b);
  EXPECT_EQ(store.Find(a), nullptr);
  ASSERT_NE(store.Find(b), nullptr);
  EXPECT_EQ(store.Find(b)->last().pixel.x(), 5.0);
  EXPECT_EQ(store.alive(), 0);
}

TEST(TrackStore, RefusesWhatBreaksItsOrder) {
  TrackStore store;
  const TrackId a = store.Start(FrameId(2), At(1.0));
  EXPECT_THROW(store.Extend(a, FrameId(1), At(1.0)), ContractViolation);
  EXPECT_THROW(store.Extend(TrackId(7), FrameId(3), At(1.0)), ContractViolation);
  store.End(a);
  EXPECT_THROW(store.Extend(a, FrameId(3), At(1.0)), ContractViolation);
}

}  // namespace
}  // namespace mlvi
