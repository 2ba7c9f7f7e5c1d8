#include "plugin_sdk/host/handshake_lie.h"

#include <algorithm>

namespace gravitas::host {
namespace {

using control::v1::Welcome;

constexpr HandshakeLie kLies[] = {
    {"magic", "no Gravitas worker", [](Welcome* w) { w->set_magic(~w->magic()); }},
    {"protocol", "another version of the control protocol", [](Welcome* w) { w->set_protocol(w->protocol() + 1); }},
    {"schema", "another schema of the stage contracts", [](Welcome* w) { w->set_schema_hash(w->schema_hash() ^ 1U); }},
    {"epoch", "answers to another greeting", [](Welcome* w) { w->set_epoch(w->epoch() - 1); }},
    {"nonce", "answers to another greeting", [](Welcome* w) { w->set_nonce(w->nonce() + 1); }},
    // results that are too small to be normal become zero
    {"arithmetic", "floating-point control register differs",
     [](Welcome* w) { w->mutable_floating_point()->set_mxcsr(w->floating_point().mxcsr() ^ 0x8000U); }},
    {"c_library", "another C library, another C library",
     [](Welcome* w) { w->mutable_floating_point()->set_c_library("another C library"); }},
    {"processor", "a processor with other features",
     [](Welcome* w) { w->mutable_floating_point()->add_cpu_features("another feature"); }},
    {"count", "another number of plugins", [](Welcome* w) { w->add_plugins(); }},
    {"name", "serves plugin 'Another'", [](Welcome* w) { w->mutable_plugins(0)->set_name("Another"); }},
    {"build", "", [](Welcome* w) { w->set_build_id("another build"); }},
};

}  // namespace

std::span<const HandshakeLie> handshake_lies() { return kLies; }

const HandshakeLie* find_handshake_lie(std::string_view what) {
  const auto* lie = std::ranges::find(kLies, what, &HandshakeLie::what);
  return lie == std::end(kLies) ? nullptr : lie;
}

}  // namespace gravitas::host
