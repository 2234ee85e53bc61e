// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The program as its users meet it: a process with an exit code and what it prints.
#pragma once

#ifdef MLVI_BINARY

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

namespace mlvi::test {

struct ProcessResult {
  int exit_code = -1;  // 128 + the signal that ended it, as shells report it
  std::string output;  // stdout and stderr
};

inline int ExitCodeOf(int wait_status) {
  return WIFSIGNALED(wait_status) ? 128 + WTERMSIG(wait_status) : WEXITSTATUS(wait_status);
}

// Runs `mlvi ARGUMENTS` through the shell; redirections of stdout may be among the arguments.
inline ProcessResult RunMlvi(const std::string& arguments) {
  std::FILE* pipe = popen(("2>&1 " + std::string(MLVI_BINARY) + " " + arguments).c_str(), "r");
  ProcessResult result;
  char buffer[4096];
  while (const std::size_t n = std::fread(buffer, 1, sizeof(buffer), pipe))
    result.output.append(buffer, n);
  result.exit_code = ExitCodeOf(pclose(pipe));
  return result;
}

inline std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// Runs `mlvi ARGUMENTS` until what it prints, in the file `log`, holds `text`; then ends it by
// SIGINT.
inline ProcessResult InterruptMlvi(const std::string& arguments, const std::filesystem::path& log,
                                   const std::string& text) {
  const std::string command =
      "exec " + std::string(MLVI_BINARY) + " " + arguments + " >" + log.string() + " 2>&1";
  const pid_t child = fork();
  if (child == 0) {
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(99);
  }
  for (int i = 0; i < 3000 && ReadFile(log).find(text) == std::string::npos; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  kill(child, SIGINT);
  int status = 0;
  waitpid(child, &status, 0);
  return {.exit_code = ExitCodeOf(status), .output = ReadFile(log)};
}

}  // namespace mlvi::test

#endif
