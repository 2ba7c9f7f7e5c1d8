// `gravitas ctl`: talks to the control API of `gravitas serve`.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "plugin_sdk/counted.h"
#include "services/cli/commands.h"
#include "services/cli/option_checks.h"
#include "services/cli/query_text.h"
#include "services/cli/scene_options.h"
#include "services/cli/terminal.h"
#include "services/control/client.h"
#include "services/control/server_socket.h"
#include "services/control/status_text.h"
#include "services/recorder/json.h"
#include "services/recorder/output_file.h"
#include "services/run/edit_spec.h"
#include "services/run/file_names.h"
#include "services/run/session.h"
#include "services/survey/joint_file.h"
#include "services/survey/picture.h"

namespace gravitas::cli {
namespace {

namespace api = control_api::v1;
using control::ControlClient;

struct CtlLine {
  std::string socket;
  bool json = false, no_wait = false;
  std::uint32_t steps = 1, captured_steps = 100, number = 0;
  std::string text;  // what a swap, a setting, a fault or a slot is
  std::string out;
  QueryText query;
  std::vector<std::string> kinds, changes;
  std::optional<std::vector<std::string>> event_kinds;
  std::optional<double> ongoing_rate;  // Hz
};

using Order = std::function<int(const CtlLine&, ControlClient*)>;

std::string socket_of(const CtlLine& line) {
  if (!line.socket.empty()) return line.socket;
  const std::vector<std::string> found = control::find_servers();
  if (found.size() == 1) return found[0];
  if (found.empty()) throw BadInput("gravitas ctl: no server is running; start one: gravitas serve SCENE --headless");
  std::string text = "gravitas ctl: several servers are running; choose one:";
  for (const std::string& path : found) text += "\n  --socket " + path;
  throw BadInput(text);
}

void tell_of_waiting(const api::Status& status) {
  std::cerr << fmt::format("gravitas ctl: {}; this waits for its end\n", control::waiting_line(status));
}

int perform(const CtlLine& line, const Order& order) {
  try {
    ControlClient client(socket_of(line));
    client.on_wait(tell_of_waiting);
    return order(line, &client);
  } catch (const control::ControlError& error) {
    using Kind = control::ControlError::Kind;
    const char* advice = error.kind == Kind::kNoServer ? "; start one: gravitas serve SCENE --headless" : "";
    std::cerr << "gravitas ctl: " << error.what() << advice << '\n';
    return error.kind == Kind::kOther ? kOurFault : kBadInput;
  }
}

void print_line(const CtlLine& line, const api::Status& status) {
  std::cout << (line.json ? to_json(status, JsonForm::kPage) : control::status_line(status) + "\n");
}

int show_status(const CtlLine& line, ControlClient* client) {
  const api::Status status = client->status();
  std::cout << (line.json ? to_json(status, JsonForm::kPage) : control::status_page(status));
  return kDone;
}

int make_steps(const CtlLine& line, ControlClient* client) {
  const api::Status status = client->step(line.steps);
  print_line(line, status);
  if (status.state() != "faulted") return kDone;
  std::cerr << "gravitas ctl: " << status.fault() << '\n';
  return kPaused;
}

// Waits for the end of a swap, and says what became of it.
int follow_swap(const CtlLine& line, ControlClient* client, const api::SwapOrdered& ordered) {
  if (line.no_wait) {
    if (line.json) {
      std::cout << to_json(ordered, JsonForm::kPage);
    } else {
      std::cout << fmt::format("ordered: swap {}, before step {}\n", ordered.number(), ordered.step());
    }
    return kDone;
  }
  api::Status status;
  const std::optional<api::ServedSwap> swap =
      control::wait_for_swap(client, ordered.number(), &status, tell_of_waiting);
  if (!swap) {
    std::cerr << "gravitas ctl: the swap is not known any more: the run was reset, or has ended\n";
    return kExaminedFailed;
  }
  std::cout << (line.json ? to_json(*swap, JsonForm::kPage) : control::swap_line(*swap) + "\n");
  if (swap->outcome() == "refused" || swap->outcome() == "rolled back") return kExaminedFailed;
  if (swap->outcome() == "committed" || status.state() == "running") return kDone;
  std::cerr << fmt::format("gravitas ctl: the run is {} at step {}{}\n", status.state(), status.step(),
                           status.state() == "paused" ? ": the swap goes on with the next steps" : "");
  if (status.state() == "faulted") std::cerr << "gravitas ctl: " << status.fault() << '\n';
  return status.state() == "faulted" ? kPaused : kDone;
}

int swap(const CtlLine& line, ControlClient* client) {
  return follow_swap(line, client, client->swap(control::parse_swap_request(line.text)));
}

int compare(const CtlLine& line, ControlClient* client) {
  const api::SwapOrdered ordered = client->swap(control::parse_swap_request(line.text, true));
  if (line.json) {
    std::cout << to_json(ordered, JsonForm::kPage);
  } else {
    std::cout << fmt::format(
        "ordered: comparison {}, from step {} on; gravitas ctl status shows how the answers differ, "
        "gravitas ctl call-off {} ends it\n",
        ordered.number(), ordered.step(), ordered.number());
  }
  return kDone;
}

int call_off(const CtlLine& line, ControlClient* client) {
  const api::ServedSwap swap = client->call_off(line.number);
  std::cout << (line.json ? to_json(swap, JsonForm::kPage) : control::swap_line(swap) + "\n");
  return kDone;
}

int set_property(const CtlLine& line, ControlClient* client) {
  return follow_swap(line, client, client->set_property(control::parse_set_request(line.text)));
}

int edit(const CtlLine& line, ControlClient* client) {
  api::EditRequest request;
  for (const std::string& change : line.changes) *request.add_changes() = parse_change(change);
  const api::EditMade made = client->edit(request);
  for (const std::string& warning : made.warnings()) std::cerr << warning << '\n';
  if (line.json) {
    std::cout << to_json(made, JsonForm::kPage);
  } else {
    std::cout << fmt::format("edited before step {}; the run stood for {:.0f} ms\n", made.step(),
                             1e-3 * made.pause_us());
  }
  return kDone;
}

int inject(const CtlLine& line, ControlClient* client) {
  const api::InjectOrdered ordered = client->inject(line.text);
  if (line.json) {
    std::cout << to_json(ordered, JsonForm::kPage);
  } else {
    std::cout << fmt::format("ordered: {} at step {}; gravitas ctl status shows what became of it\n", line.text,
                             ordered.step());
  }
  return kDone;
}

int capture_calls(const CtlLine& line, ControlClient* client) {
  api::CaptureRequest request;
  request.set_slot(line.text);
  request.set_path(std::filesystem::absolute(line.out).lexically_normal().string());
  request.set_steps(line.captured_steps);
  if (client->status().state() == "paused")
    std::cerr << "gravitas ctl: the run is paused: the calls come with its next steps; Ctrl-C ends the capture\n";
  listen_to_interrupts();
  // from here on a signal ends the capture, not the program
  if (interrupted()) return kInterrupted;
  const api::Captured captured = client->capture(request, interrupted);
  if (line.json) {
    std::cout << to_json(captured, JsonForm::kPage);
  } else {
    std::cout << fmt::format("{}: {} of slot {} in {} from step {} on\n", line.out, counted(captured.calls(), "call"),
                             line.text, counted(captured.steps(), "step"), captured.first_step());
  }
  if (captured.steps() == line.captured_steps) return kDone;
  if (interrupted()) return kInterrupted;
  std::cerr << "gravitas ctl: the run ended or was reset before\n";
  return kExaminedFailed;
}

int query(const CtlLine& line, ControlClient* client) {
  const query::v1::Batch batch = parse_query(line.query);
  const query::v1::Answers answers = client->query(batch);
  std::cout << (line.json ? to_json(answers, JsonForm::kPage) : answers_text(answers));
  return kDone;
}

int show_instrumentation(const CtlLine& line, ControlClient* client) {
  api::InstrumentationRequest request;
  for (const std::string& kind : line.kinds) request.add_kinds(kind);
  const instrumentation::v1::Frame frame = client->instrumentation(request);
  for (const std::string& reason : frame.missing()) std::cerr << "gravitas ctl: missing: " << reason << '\n';
  const api::Status status = client->status();
  std::vector<NamedFile> files;
  for (const std::string& file : status.files()) files.push_back({"a file of the run,", file});
  require_separate(files, {{"--out", line.out}});
  const bool is_picture = line.out.ends_with(".svg");
  const std::string text = is_picture ? survey::picture(frame, status.scene()) : to_json(frame, JsonForm::kLine);
  if (line.out.empty()) {
    std::cout << text;
    return kDone;
  }
  try {
    OutputFile file("instrumentation", line.out, OutputFile::Allowed::kOrdinary);
    file.write(text);
    file.close();
  } catch (const std::runtime_error& problem) {
    throw BadInput(problem.what());
  }
  return kDone;
}

// As the file of `gravitas run --joints`.
int show_joints(const CtlLine&, ControlClient* client) {
  const api::Joints joints = client->joints();
  std::cout << survey::kJointHead;
  for (const api::JointCoordinate& one : joints.coordinates())
    std::cout << survey::joint_row(joints.time(), one.joint(), one.name(), one.value(), one.rate());
  for (const std::string& reason : joints.missing()) std::cerr << "gravitas: joints lacks " << reason << '\n';
  return kDone;
}

// The lines of the file of `gravitas run --reactions`.
int show_reactions(const CtlLine&, ControlClient* client) {
  const api::Reactions last = client->reactions();
  for (const report::v1::Reaction& reaction : last.reactions()) std::cout << to_json(reaction, JsonForm::kLine);
  return kDone;
}

// A page that is rewritten in place on a terminal, a line per second elsewhere.
int watch(const CtlLine& line, ControlClient* client) {
  const bool is_terminal = isatty(STDOUT_FILENO) == 1 && !line.json;
  std::ptrdiff_t rows = 0;
  client->watch(is_terminal ? 250 : 1000, [&](const api::Status& status) {
    if (line.json) {
      std::cout << to_json(status, JsonForm::kLine) << std::flush;
    } else if (!is_terminal) {
      std::cout << control::status_line(status) << std::endl;
    } else {
      const std::string page = control::status_page(status);
      // up to the first row of the last page, and clear from there; long rows are cut, not wrapped
      std::cout << "\x1b[?7l" << (rows > 0 ? fmt::format("\x1b[{}F", rows) : "") << "\x1b[J" << page << "\x1b[?7h"
                << std::flush;
      rows = std::ranges::count(page, '\n');
    }
    return std::cout.good();
  });
  std::cerr << "gravitas ctl: the server has ended\n";
  return kDone;
}

int show_events(const CtlLine& line, ControlClient* client) {
  api::EventsRequest request;
  for (const std::string& kind : line.event_kinds.value_or(std::vector<std::string>())) request.add_kinds(kind);
  request.set_ongoing_rate(line.ongoing_rate.value_or(0.0));
  client->watch_events(
      request, [] {},
      [](const events::v1::Event& event) {
        std::cout << to_json(event, JsonForm::kLine) << std::flush;
        return std::cout.good();
      });
  std::cerr << "gravitas ctl: the server has ended\n";
  return kDone;
}

}  // namespace

void add_ctl(CLI::App* app, Action* action) {
  const auto line = std::make_shared<CtlLine>();
  CLI::App* ctl = app->add_subcommand("ctl", "Watch and control a run of `gravitas serve`");
  ctl->require_subcommand(1);
  ctl->footer("Example: gravitas ctl status");
  ctl->add_option("--socket", line->socket,
                  "Socket of the server, or ADDR:PORT where it listens; the one that is running if absent");
  const auto add = [&](const char* name, const char* meaning, const char* example, Order order) {
    CLI::App* command = ctl->add_subcommand(name, meaning);
    command->footer(fmt::format("Example: gravitas ctl {}", example));
    // options of ctl may stand behind the sub-command
    command->fallthrough();
    command->add_flag("--json", line->json, "Print JSON");
    command->callback([=] { *action = [=] { return perform(*line, order); }; });
    return command;
  };
  const auto then_line = [](api::Status (ControlClient::*call)()) {
    return [call](const CtlLine& now, ControlClient* client) {
      print_line(now, (client->*call)());
      return kDone;
    };
  };
  add("status", "Where the run is, who serves it, swaps and faults", "status --json", show_status);
  add("pause", "Pause after the step that is being made", "pause", then_line(&ControlClient::pause));
  add("resume", "Go on", "resume", then_line(&ControlClient::resume));
  add("step", "Make steps of a paused run; Ctrl-C ends them", "step 10", make_steps)
      ->add_option("N", line->steps, "Number of steps [1]")
      ->check(whole_number(1));
  add("reset", "Back to t = 0, with the plugins of the scene", "reset", then_line(&ControlClient::reset));
  const auto add_order = [&](const char* name, const char* meaning, const char* example, Order order, const char* word,
                             const char* form) {
    CLI::App* command = add(name, meaning, example, std::move(order));
    command->add_option(word, line->text, form)->required();
    return command;
  };
  const char* no_wait = "Do not wait until it is committed, rolled back or refused";
  add_order("swap", "Exchange a plugin while the run goes on; exit code 4 if it is refused or rolled back",
            "swap solver=Sequential@step=500,hosting=grpc", swap, "SPEC",
            "SLOT=PLUGIN[@step=N][,hosting=direct|shm|grpc]: before step N, or the next")
      ->add_flag("--no-wait", line->no_wait, no_wait);
  add_order("compare",
            "Ask another plugin the same from now on, and compare its answers and its time; it never takes over",
            "compare solver=Newton", compare, "SPEC", "SLOT=PLUGIN[,hosting=direct|shm|grpc]");
  add("call-off", "Call a swap off that has not cut over, or end a comparison", "call-off 3", call_off)
      ->add_option("NUMBER", line->number, "As `gravitas ctl status` lists it")
      ->required()
      ->check(whole_number(1));
  add_order("set", "Change a live property of a plugin", "set Solver.Iterations=50", set_property, "SPEC",
            "Slot.Property=VALUE")
      ->add_flag("--no-wait", line->no_wait, no_wait);
  add("edit", "Change the scene while the run goes on: all changes or none",
      "edit 'remove Constraint.Hinge' 'set Body.Door.LinearVelocity={1,0,0}' 'add more.gravitas'", edit)
      ->add_option("CHANGE", line->changes,
                   "\"add FILE\" (Geometries, Materials, Forces, Bodies, Constraints), \"remove Body.Ball\", "
                   "\"set Body.Ball.Position={0,1,0}\"")
      ->required();
  add_order(
      "wake", "Wake a body that sleeps, with those that it touches", "wake Ball",
      [](const CtlLine& now, ControlClient* client) {
        print_line(now, client->wake(now.text));
        return kDone;
      },
      "BODY", "Id of the body");
  add_order("inject", "Have a worker commit a fault", "inject solver:kill", inject, "SPEC",
            "SLOT:KIND[@step=N][,ARGUMENT=VALUE]...: at step N, or the next");
  CLI::App* capture_command =
      add_order("capture", "Keep a slot's calls in the next steps as a capsule, for gravitas replay and bisect",
                "capture solver --out solver.capsule --steps 50", capture_calls, "SLOT",
                "space, collision, constraint, force, solver or integrator");
  capture_command->add_option("--out", line->out, "The capsule's file, on the server's machine")->required();
  capture_command->add_option("--steps", line->captured_steps, "For so many steps")
      ->check(whole_number(1))
      ->capture_default_str();
  CLI::App* query_command =
      add("query", "Ask about the bodies where they are now: rays, shape casts, overlap, closest points",
          "query --ray 0,5,0,0,-1,0 --closest Ball01=0.5", query);
  query_command->add_option("BATCH", line->query.batch,
                            "A batch as JSON (schemas/gravitas/query/v1/query.proto), or @FILE that holds one");
  const auto add_questions = [&](const char* name, std::vector<std::string>* values, const char* text) {
    query_command->add_option(name, *values, text)->take_all()->allow_extra_args(false);
  };
  add_questions("--ray", &line->query.rays, "X,Y,Z,DX,DY,DZ[,LENGTH]: from where, which way, how far; repeatable");
  add_questions("--overlap", &line->query.overlaps, "BODY: what it overlaps; repeatable");
  add_questions("--closest", &line->query.closest, "BODY=DISTANCE: what is within that distance, m; repeatable");
  query_command->add_flag("--all", line->query.all, "All bodies that a ray meets, not the closest alone");
  CLI::App* picture = add("instrumentation", "Debug geometry of the state, as JSON or as a picture",
                          "instrumentation --kinds contact,shape --out now.svg", show_instrumentation);
  picture->add_option("--kinds", line->kinds, "Kinds, separated by commas; all if absent")
      ->delimiter(',')
      ->allow_extra_args(false);
  picture->add_option("--out", line->out, "File: JSON, or a picture if its name ends in .svg");
  add("joints", "Coordinates of the joints that hold and their rates, as CSV", "joints", show_joints);
  add("reactions", "Forces and torques of joints and contacts in the last step, as JSON lines", "reactions",
      show_reactions);
  add("watch", "Show the status until Ctrl-C, or until the server ends", "watch", watch);
  CLI::App* events_command = add("events", "Print events from now on as JSON lines, until Ctrl-C or the server ends",
                                 "events --kinds collision_start,fault,swap", show_events);
  add_event_options(events_command, "--kinds", &line->event_kinds, &line->ongoing_rate);
}

}  // namespace gravitas::cli
