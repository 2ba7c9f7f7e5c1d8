// `gravitas serve`: a run that goes on while others watch and control it.
#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <charconv>
#include <cmath>
#include <csignal>
#include <iostream>
#include <memory>
#include <optional>
#include <system_error>

#include "plugin_sdk/channel/address.h"
#include "services/cli/commands.h"
#include "services/cli/option_checks.h"
#include "services/cli/scene_options.h"
#include "services/cli/terminal.h"
#include "services/control/served_run.h"
#include "services/control/server.h"
#include "services/control/server_socket.h"
#include "services/control/status_text.h"

namespace gravitas::cli {
namespace {

struct ServeLine {
  control::ServeOptions options;
  SceneOptions scene{&options.run};
  std::string socket, listen;
  bool headless = false, remote = false;
};

bool has_port(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos) return false;
  std::uint16_t port = 0;
  const char* const last = address.data() + address.size();
  const auto [end, error] = std::from_chars(address.data() + colon + 1, last, port);
  return error == std::errc() && end == last;
}

int serve(ServeLine* line) {
  if (!line->headless) throw BadInput("gravitas serve: the page comes later; allowed: --headless");
  if (!std::isfinite(line->options.speed) || line->options.speed < 0.0)
    throw BadInput(
        fmt::format("--speed {:g}: allowed: a finite number > 0, or 0: as fast as possible", line->options.speed));
  if (line->listen.starts_with("unix:"))
    throw BadInput(fmt::format("--listen {}: allowed: ADDR:PORT; a path is given by --socket {}", line->listen,
                               line->listen.substr(std::string_view("unix:").size())));
  if (!line->listen.empty() && !has_port(line->listen))
    throw BadInput(fmt::format("--listen {}: allowed: ADDR:PORT, with a port from 0 to 65535, such as 127.0.0.1:4711",
                               line->listen));
  if (!line->listen.empty() && !line->remote && !channel::is_local_address(line->listen))
    throw BadInput(fmt::format(
        "--listen {}: nothing is encrypted and whoever connects controls the run, so only this machine is allowed: "
        "127.0.0.1:PORT or [::1]:PORT; others with --allow-remote",
        line->listen));
  line->scene.apply();
  line->options.hosting_words = line->scene.hosting_words();
  listen_to_interrupts();
  let_writes_fail();
  control::ServedRun run(line->options);
  // from here on a signal ends it in order
  boost::asio::io_context loop;
  boost::asio::signal_set signals(loop, SIGINT, SIGTERM);
  // ignored under nohup
  if (std::signal(SIGHUP, SIG_DFL) == SIG_IGN)
    std::signal(SIGHUP, SIG_IGN);
  else
    signals.add(SIGHUP);
  signals.async_wait([&](const boost::system::error_code&, int) {
    // the second one ends the program
    signals.clear();
  });

  for (const std::string& warning : run.scene_warnings()) std::cerr << warning << '\n';
  {
    const control::ServerSocket socket(line->socket);
    const control::ControlServer server(&run, socket.path(), line->listen);
    std::cout << fmt::format("serving {} at unix:{}{}\n", run.scene(), socket.path(),
                             server.address().empty() ? "" : " and " + server.address())
              << std::flush;
    loop.run();
    run.interrupt();
  }
  std::optional<control::ServedRun::Saved> saved;
  try {
    saved = run.save_checkpoint();
  } catch (const std::system_error&) {
    // the fault has told why
    if (run.status().state() != "faulted") throw;
  }
  const control_api::v1::Status status = run.status();
  std::cout << control::status_page(status);
  if (saved && !saved->go_on_by.empty())
    std::cerr << fmt::format("gravitas: checkpoint '{}' holds step {}; to go on: {}\n", status.checkpoint(),
                             saved->step, saved->go_on_by);
  if (status.state() == "finished") return kDone;
  if (status.state() != "faulted") return kInterrupted;
  std::cerr << "gravitas: " << status.fault() << '\n';
  return kPaused;
}

}  // namespace

void add_serve(CLI::App* app, Action* action) {
  const auto line = std::make_shared<ServeLine>();
  CLI::App* command = app->add_subcommand("serve", "Simulate a scene in real time, controlled by `gravitas ctl`");
  command->footer(
      "Example: gravitas serve deploy/scenes/two_spheres_motor.gravitas --headless --duration 3600 &\n"
      "         gravitas ctl status; gravitas ctl swap solver=Sequential,hosting=direct\n"
      "Ends with Ctrl-C (exit code 130; 0 after the last step, 3 after a fault that the run did not survive). The "
      "socket is the only guard: whoever may open it, or "
      "reaches the address, controls the run and what it loads.");
  line->scene.add_to(command);
  command->add_flag("--headless", line->headless, "The control API alone, without the page");
  command
      ->add_option("--speed", line->options.speed,
                   "Simulated seconds per second; 0: as fast as possible [1: real time]")
      ->check(any_number("a finite number > 0, or 0: as fast as possible"));
  command->add_flag("--paused", line->options.is_paused, "Begin paused");
  CLI::Option* listen =
      command->add_option("--listen", line->listen, "Listen at ADDR:PORT of this machine, too; port 0: a free one");
  command->add_flag("--allow-remote", line->remote, "Let --listen take an address that others reach")->needs(listen);
  CLI::Option* checkpoint = command->add_option(
      "--checkpoint", line->options.run.checkpoint,
      "Keep a checkpoint in this file (replaced as a whole) and a journal in FILE.journal, with what was changed live: "
      "at "
      "the start, at the end, and as --checkpoint-every says; --resume, here and of `gravitas run`, goes on from it. A "
      "reset begins it anew");
  command
      ->add_option("--checkpoint-every", line->options.run.checkpoint_every,
                   "Steps between checkpoints, counted from t = 0")
      ->check(whole_number(1))
      ->needs(checkpoint);
  command->add_option("--resume", line->options.run.resume,
                      "Go on from this checkpoint and the journal beside it, of a server or a run; --steps and "
                      "--duration count from t = 0, and a reset begins the scene; a library that was swapped in by "
                      "its path must be installed, or named by the scene");
  add_despite_journal(command, &line->options.run);
  add_comparisons(command, &line->options.run.comparisons);
  command->add_option("--socket", line->socket,
                      "Listen at this path instead of a private folder in $XDG_RUNTIME_DIR or /tmp");
  command->callback([=] { *action = [=] { return serve(line.get()); }; });
}

}  // namespace gravitas::cli
