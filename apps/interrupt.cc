// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include "interrupt.h"

namespace {

// A signal handler can reach nothing but an object of static storage.
volatile std::sig_atomic_t received_signal = 0;

void Remember(int signal) {
  received_signal = signal;
  std::signal(signal, SIG_DFL);
}

}  // namespace

InterruptGuard::InterruptGuard()
    : previous_interrupt_(std::signal(SIGINT, Remember)),
      previous_terminate_(std::signal(SIGTERM, Remember)) {
  received_signal = 0;
}

InterruptGuard::~InterruptGuard() {
  std::signal(SIGINT, previous_interrupt_);
  std::signal(SIGTERM, previous_terminate_);
}

bool InterruptGuard::interrupted() const { return received_signal != 0; }
