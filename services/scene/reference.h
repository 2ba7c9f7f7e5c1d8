// The reference page of the scene language, written from what the reader and the builder themselves go by: the
// grammar (schemas/gravitas/scene/v1/scene.proto) and the plugins' declarations.
#pragma once

#include <string>

#include "services/catalog/catalog.h"

namespace gravitas::scene {

// The whole page as Markdown: a table per block, then a table per plugin and type.
std::string reference_page(const Catalog& catalog);

}  // namespace gravitas::scene
