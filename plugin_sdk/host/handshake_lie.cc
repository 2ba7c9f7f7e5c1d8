#include "plugin_sdk/host/handshake_lie.h"

#include <array>

namespace gravitas::host {
namespace {

using control::v1::Welcome;

struct Lie {
  const char* what;
  void (*tell)(Welcome*);
};

constexpr std::array<Lie, 11> kLies = {{
    {"magic", [](Welcome* w) { w->set_magic(~w->magic()); }},
    {"protocol", [](Welcome* w) { w->set_protocol(w->protocol() + 1); }},
    {"schema", [](Welcome* w) { w->set_schema_hash(w->schema_hash() ^ 1U); }},
    {"epoch", [](Welcome* w) { w->set_epoch(w->epoch() - 1); }},
    {"nonce", [](Welcome* w) { w->set_nonce(w->nonce() + 1); }},
    // results that are too small to be normal become zero
    {"arithmetic", [](Welcome* w) { w->mutable_floating_point()->set_mxcsr(w->floating_point().mxcsr() ^ 0x8000U); }},
    {"c_library", [](Welcome* w) { w->mutable_floating_point()->set_c_library("another C library"); }},
    {"processor", [](Welcome* w) { w->mutable_floating_point()->add_cpu_features("another feature"); }},
    {"count", [](Welcome* w) { w->add_plugins(); }},
    {"name", [](Welcome* w) { w->mutable_plugins(0)->set_name("Another"); }},
    {"build", [](Welcome* w) { w->set_build_id("another build"); }},
}};

}  // namespace

std::vector<std::string> handshake_lies() {
  std::vector<std::string> words;
  for (const Lie& lie : kLies) words.emplace_back(lie.what);
  return words;
}

void tell_lie(std::string_view what, Welcome* welcome) {
  for (const Lie& lie : kLies)
    if (what == lie.what) lie.tell(welcome);
}

}  // namespace gravitas::host
