// Messages as JSON with the names of their schema, every field present.
#pragma once

#include <google/protobuf/message.h>

#include <string>

namespace gravitas {

enum class JsonForm {
  kPage,  // indented, over several lines
  kLine   // one line; ends with a line break
};

std::string to_json(const google::protobuf::Message& message, JsonForm form);

}  // namespace gravitas
