#include "services/campaign/campaign.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "plugin_sdk/shell_word.h"
#include "plugin_sdk/slots.h"
#include "services/campaign/leftovers.h"
#include "services/campaign/page.h"
#include "services/campaign/table.h"
#include "services/recorder/durable_file.h"
#include "services/recorder/json.h"
#include "services/run/session.h"

extern char** environ;

namespace gravitas::campaign {
namespace {

using Clock = std::chrono::steady_clock;

// Trials of one order: few where each takes long.
constexpr std::uint64_t kRealBatch = 1, kSimulatedBatch = 32;
// What a child that was asked to end, and orphans of a child that crashed, may take to be gone.
constexpr std::chrono::seconds kEndLimit{5};

[[noreturn]] void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// The options that decide what a trial does, as words.
std::vector<std::string> trial_words(const Options& options) {
  std::vector<std::string> words = options.scenes;
  const auto add = [&](const std::string& name, const std::string& value) {
    words.push_back(name);
    words.push_back(value);
  };
  add("--tier", options.draw.tier == Tier::kReal ? "real" : "simulated");
  if (options.draw.tier == Tier::kReal)
    add("--hosting", options.draw.hostings.size() > 1 ? "both" : kernel::hosting_name(options.draw.hostings[0]));
  add("--per-trial", std::to_string(options.draw.faults_per_trial));
  add("--deadline", fmt::format("{}", options.deadline));
  if (!options.without.empty()) add("--without", options.without);
  return words;
}

// A process that makes trials.
class Child {
 public:
  explicit Child(const Options& options) {
    int orders[2], lines[2];
    if (pipe2(orders, O_CLOEXEC) != 0 || pipe2(lines, O_CLOEXEC) != 0) fail("pipes for a campaign's process");
    std::vector<std::string> words = {"/proc/self/exe", "campaign"};
    for (std::string& word : trial_words(options)) words.push_back(std::move(word));
    words.insert(words.end(), {"--seed", std::to_string(options.seed), "--serve-trials"});
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, orders[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, lines[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const int problem = posix_spawn(&process_, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(orders[0]);
    close(lines[1]);
    orders_ = orders[1];
    lines_ = lines[0];
    if (problem != 0) {
      errno = problem;
      fail("a process of the campaign");
    }
  }
  ~Child() {
    if (orders_ >= 0) close(orders_);
    // it ends at the end of its orders
    const auto until = Clock::now() + kEndLimit;
    while (!has_ended() && Clock::now() < until) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    end_now();
    close(lines_);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  int descriptor() const { return lines_; }

  void order(std::uint64_t first, std::uint64_t count, std::uint64_t stride) {
    const std::string line = fmt::format("{} {} {}\n", first, count, stride);
    // a child that has ended is noticed by its lines
    if (write(orders_, line.data(), line.size()) < 0 && errno != EPIPE) fail("an order to a campaign's process");
    is_busy_ = true;
    last_word_ = Clock::now();
  }
  bool is_busy() const { return is_busy_; }
  std::uint64_t current() const { return current_; }
  double silence() const { return seconds_since(last_word_); }

  // Reads what there is; false at the end of its lines.
  template <typename OnTrial>
  bool read_lines(OnTrial&& on_trial) {
    char buffer[65536];
    const ssize_t size = read(lines_, buffer, sizeof buffer);
    if (size <= 0) return size < 0 && errno == EINTR;
    last_word_ = Clock::now();
    text_.append(buffer, static_cast<std::size_t>(size));
    for (std::size_t end; (end = text_.find('\n')) != std::string::npos; text_.erase(0, end + 1)) {
      const std::string line = text_.substr(0, end);
      if (line.starts_with("begin ")) {
        current_ = std::stoull(line.substr(6));
      } else if (line == "done") {
        is_busy_ = false;
      } else {
        on_trial(line);
      }
    }
    return true;
  }

  // Ends it, and says how it had ended.
  std::string end_now() {
    if (process_ <= 0) return {};
    if (!has_ended()) {
      ::kill(process_, SIGKILL);
      waitpid(process_, &status_, 0);
    }
    process_ = -1;
    return WIFSIGNALED(status_) ? fmt::format("killed by signal {}", WTERMSIG(status_))
                                : fmt::format("ended with exit code {}", WEXITSTATUS(status_));
  }

 private:
  bool has_ended() {
    if (process_ <= 0 || has_ended_) return true;
    return has_ended_ = waitpid(process_, &status_, WNOHANG) == process_;
  }

  pid_t process_ = -1;
  int orders_ = -1, lines_ = -1, status_ = 0;
  bool is_busy_ = false, has_ended_ = false;
  std::uint64_t current_ = 0;
  std::string text_;
  Clock::time_point last_word_ = Clock::now();
};

class TrialLog {
 public:
  explicit TrialLog(const std::string& folder) {
    if (folder.empty()) return;
    std::error_code problem;
    std::filesystem::create_directories(folder, problem);
    if (problem)
      throw BadInput("--out '" + folder + "': " + problem.message() + "; allowed: a folder that can be made");
    path_ = folder + "/trials.jsonl";
    file_ = std::fopen(path_.c_str(), "we");
    if (file_ == nullptr) fail("'" + path_ + "'");
  }
  ~TrialLog() {
    if (file_ != nullptr) std::fclose(file_);
  }
  TrialLog(const TrialLog&) = delete;
  TrialLog& operator=(const TrialLog&) = delete;
  // Throws where not all that was written is in the file.
  void close() {
    if (std::FILE* file = std::exchange(file_, nullptr); file != nullptr && std::fclose(file) != 0)
      fail("'" + path_ + "'");
  }
  void write(const std::string& line) {
    if (file_ != nullptr && std::fprintf(file_, "%s\n", line.c_str()) < 0) fail("'" + path_ + "'");
  }

 private:
  std::string path_;
  std::FILE* file_ = nullptr;
};

class Parent {
 public:
  Parent(const Options& options) : options_(options), log_(options.out), next_(options.shard - 1) {
    wanted_ = (options.faults + options.shards - 1) / options.shards;
    batch_ = options.draw.tier == Tier::kReal ? kRealBatch : kSimulatedBatch;
  }

  v1::Table make(const std::function<bool()>& interrupted, const std::function<void(const Progress&)>& progress) {
    // whom a crashed child leaves behind comes to us
    prctl(PR_SET_CHILD_SUBREAPER, 1);
    ::signal(SIGPIPE, SIG_IGN);
    const std::uint32_t cores = std::max(1U, std::thread::hardware_concurrency());
    const std::uint64_t useful = wanted_ / (batch_ * options_.draw.faults_per_trial) + 1;
    for (std::uint64_t i = 0; i < std::min<std::uint64_t>(options_.jobs > 0 ? options_.jobs : cores, useful); ++i)
      children_.push_back(std::make_unique<Child>(options_));
    while (!children_.empty()) {
      const bool is_enough = interrupted() || tally_.injected() >= wanted_ || tally_.forbidden() >= give_up_;
      std::erase_if(children_, [&](const std::unique_ptr<Child>& child) { return is_enough && !child->is_busy(); });
      for (const std::unique_ptr<Child>& child : children_)
        if (!child->is_busy()) {
          child->order(next_, batch_, options_.shards);
          next_ += batch_ * options_.shards;
        }
      listen();
      progress({tally_.injected(), wanted_, tally_.forbidden(), seconds_since(start_)});
    }
    find_orphans();
    log_.close();
    v1::Table table = tally_.table();
    table.set_seed(options_.seed);
    table.set_tier(options_.draw.tier == Tier::kReal ? "real" : "simulated");
    table.set_seconds(seconds_since(start_));
    if (!options_.out.empty()) table.set_logged(static_cast<std::uint32_t>(logged_));
    if (options_.out.empty()) return table;
    write_text_file(options_.out + "/table.txt", table_text(table), "table");
    write_text_file(options_.out + "/table.json", to_json(table, JsonForm::kPage), "table");
    write_text_file(options_.out + "/index.html", page(table, tally_), "page");
    return table;
  }

 private:
  void listen() {
    std::vector<pollfd> polled;
    for (const std::unique_ptr<Child>& child : children_) polled.push_back({child->descriptor(), POLLIN, 0});
    if (poll(polled.data(), polled.size(), 100) < 0 && errno != EINTR) fail("poll");
    for (std::size_t i = 0; i < children_.size(); ++i) {
      std::unique_ptr<Child>& child = children_[i];
      bool goes_on = true;
      if (polled[i].revents != 0) goes_on = child->read_lines([&](const std::string& line) { take(line); });
      const bool hangs = goes_on && child->is_busy() && child->silence() > options_.patience;
      if (goes_on && !hangs) continue;
      // whatever it was: the trial goes down as forbidden, what was left of its batch is left out, and another process
      // goes on behind it
      const std::string ending = child->end_now();
      blame(child->current(), hangs ? fmt::format("the kernel hung for {} s", options_.patience)
                                    : fmt::format("the kernel's process was {}", ending));
      child = std::make_unique<Child>(options_);
    }
  }

  void take(const std::string& line) {
    v1::Trial trial;
    if (!google::protobuf::util::JsonStringToMessage(line, &trial).ok()) {
      trial.add_forbidden("a trial's line cannot be read: " + line.substr(0, 200));
    }
    book(trial, line);
  }

  void blame(std::uint64_t index, const std::string& what) {
    v1::Trial trial;
    trial.set_seed(trial_seed(options_.seed, index));
    trial.add_forbidden(what);
    std::string line = to_json(trial, JsonForm::kLine);
    line.pop_back();
    book(trial, line);
  }

  void book(const v1::Trial& trial, const std::string& line) {
    tally_.add(trial, repeat_command(options_, trial.seed()));
    // a million simulated faults would fill a disk with what went well
    const bool is_plain = trial.forbidden().empty() && trial.unprovoked().empty() &&
                          std::ranges::all_of(trial.faults(), [](const v1::Fault& fault) {
                            return fault.outcome() == "M" || fault.outcome() == "B";
                          });
    if (options_.draw.tier == Tier::kSimulated && is_plain) return;
    log_.write(line);
    ++logged_;
  }

  void find_orphans() {
    const auto until = Clock::now() + kEndLimit;
    int status = 0;
    for (pid_t ended; (ended = waitpid(-1, &status, WNOHANG)) >= 0;) {
      if (ended == 0 && Clock::now() > until) {
        v1::Trial trial;
        for (const int process : child_processes()) {
          trial.add_forbidden(fmt::format("process {} outlived the kernel", process));
          ::kill(process, SIGKILL);
        }
        tally_.add(trial, {});
        return;
      }
      if (ended == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

  const Options& options_;
  TrialLog log_;
  Tally tally_;
  std::uint64_t next_, wanted_ = 0, batch_ = 1, logged_ = 0;
  // a self-test has seen enough at once
  const std::uint64_t give_up_ = options_.without.empty() ? 20 : 4;
  std::vector<std::unique_ptr<Child>> children_;
  Clock::time_point start_ = Clock::now();
};

std::vector<Scene> scenes_of(const Options& options) {
  std::vector<Scene> scenes = load_scenes(options.scenes);
  for (const Scene& scene : scenes)
    if (options.draw.tier == Tier::kSimulated && !scene.commands.empty())
      throw BadInput(
          fmt::format("scene '{}': the worker of slot {} is a Command, which is a process of its own; allowed: --tier "
                      "real",
                      scene.name, slot_name(scene.commands[0])));
  return scenes;
}

TrialOptions trial_options(const Options& options) {
  TrialOptions one;
  one.tier = options.draw.tier;
  one.deadline = options.deadline;
  if (!options.without.empty()) leave_out_defence(options.without, &one);
  return one;
}

}  // namespace

v1::Table run(const Options& options, const std::function<bool()>& interrupted,
              const std::function<void(const Progress&)>& progress) {
  // bad input is found here, not in a child
  scenes_of(options);
  trial_options(options);
  return Parent(options).make(interrupted, progress);
}

void serve_trials(const Options& options) {
  const std::vector<Scene> scenes = scenes_of(options);
  const TrialOptions one = trial_options(options);
  std::uint64_t first = 0, count = 0, stride = 0;
  while (std::cin >> first >> count >> stride) {
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t index = first + i * stride;
      std::cout << "begin " << index << std::endl;
      const TrialPlan plan = draw_trial(trial_seed(options.seed, index), scenes, options.draw);
      std::cout << to_json(run_trial(plan, scenes[plan.scene], one), JsonForm::kLine) << std::flush;
    }
    std::cout << "done" << std::endl;
  }
}

v1::Trial repeat_trial(const Options& options, std::uint64_t seed) {
  const std::vector<Scene> scenes = scenes_of(options);
  const TrialPlan plan = draw_trial(seed, scenes, options.draw);
  return run_trial(plan, scenes[plan.scene], trial_options(options));
}

std::string repeat_command(const Options& options, std::uint64_t seed) {
  std::string command = "gravitas campaign";
  for (const std::string& word : trial_words(options)) command += " " + shell_word(word);
  return fmt::format("{} --trial {}", command, seed);
}

}  // namespace gravitas::campaign
