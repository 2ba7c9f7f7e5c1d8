// Messages of the control stream, in both directions, and what the receivers make of them.
#include "gravitas/control/v1/control.pb.h"
#include "gravitas/plugin/v1/description.pb.h"
#include "plugin_sdk/host/control_service.h"
#include "plugin_sdk/host/description_message.h"
#include "tests/fuzz/fuzz_target.h"

namespace gravitas::fuzz {

void control(std::span<const std::byte> bytes) {
  const int size = static_cast<int>(bytes.size());
  control::v1::WorkerMessage from_worker;
  if (from_worker.ParseFromArray(bytes.data(), size) && from_worker.has_welcome())
    for (const plugin::v1::Description& description : from_worker.welcome().plugins())
      static_cast<void>(host::from_message(description));

  plugin::v1::Catalog catalog;
  if (catalog.ParseFromArray(bytes.data(), size))
    for (const plugin::v1::Catalog::Entry& entry : catalog.entries()) {
      const PluginDeclaration declaration = host::from_message(entry.description());
      const plugin::v1::Description once = host::to_message(declaration);
      require(host::to_message(host::from_message(once)).SerializeAsString() == once.SerializeAsString(),
              "a declaration survives a round trip");
    }

  control::v1::KernelMessage from_kernel;
  if (!from_kernel.ParseFromArray(bytes.data(), size) || !from_kernel.has_hello()) return;
  std::vector<plugin::v1::Description> served(1);
  served[0].set_name("Served");
  const host::ControlService service(served, 0x1f80, [](const control::v1::Hello&) { return host::Admission{}; });
  const host::Admission admission = service.judge(from_kernel.hello());
  const bool is_ours = from_kernel.hello().magic() == GRAVITAS_MAGIC && from_kernel.hello().plugins_size() == 1;
  require(!admission.text.empty() || is_ours, "a greeting that is not for this worker is refused with a text");
}

}  // namespace gravitas::fuzz
