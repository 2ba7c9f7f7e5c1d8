#include "services/recorder/json.h"

#include <google/protobuf/util/json_util.h>

#include <stdexcept>

namespace gravitas {

std::string to_json(const google::protobuf::Message& message, JsonForm form) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = form == JsonForm::kPage;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw std::runtime_error("cannot write JSON: " + std::string(status.message()));
  if (form == JsonForm::kLine) text += '\n';
  return text;
}

}  // namespace gravitas
