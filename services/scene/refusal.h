// What a plugin refuses of a scene, for the scene's author: the rows of its request (plugin_sdk/refused_row.h) as Ids, and
// the places where they stand.
#pragma once

#include <optional>
#include <string>

#include "kernel/description.h"
#include "kernel/fault.h"
#include "services/scene/problem.h"

namespace gravitas::scene {

// The fault's text; "joint 3: …" and "application 3: …" of a refusal are `Constraint "Id": …` and
// `Force "Id" on Body "Id": …` in it, and "body 3 …" of collision is `Body "Id" …`.
std::string refusal_text(const kernel::EnvironmentDescription& description, const kernel::StageFault& fault);

// The same without "it refused", at a place of the scene: that of the last written property that the text names; else that
// of the joint, of the force, or of the plugin whose settings are refused. Nothing for faults that are about nothing
// written in the scene.
std::optional<SceneError> find_refused(const v1::Scene& scene, const kernel::EnvironmentDescription& description,
                                       const kernel::StageFault& fault);

// Why an environment cannot be made of the scene, likewise, where that is the simulator's Type.
std::optional<SceneError> find_refused(const v1::Scene& scene, const std::string& why);

}  // namespace gravitas::scene
