// What each slot contributes: its cases of C5, and its ordinary questions.
#pragma once

#include <vector>

#include "plugin_sdk/conformance/conformance.h"
#include "plugin_sdk/conformance/draw.h"

namespace gravitas::conformance {

std::vector<Case> space_cases(const PluginDeclaration& declaration);
std::vector<Case> collision_cases(const PluginDeclaration& declaration);
// Of the optional methods of slot collision.
std::vector<Case> moving_collision_cases(const PluginDeclaration& declaration);
// Of the optional question for debug geometry.
std::vector<Case> collision_geometry_cases(const PluginDeclaration& declaration);
std::vector<Case> space_geometry_cases(const PluginDeclaration& declaration);
std::vector<Case> constraint_cases(const PluginDeclaration& declaration);
// Of the optional question of slot constraint.
std::vector<Case> coordinate_cases(const PluginDeclaration& declaration);
std::vector<Case> force_cases(const PluginDeclaration& declaration);
std::vector<Case> solver_cases(const PluginDeclaration& declaration);
// Of slot solver, for those that take motion from an integrator.
std::vector<Case> contact_cases(const PluginDeclaration& declaration);
// Of the optional methods of slot solver.
std::vector<Case> reaction_cases(const PluginDeclaration& declaration);
std::vector<Case> integrator_cases(const PluginDeclaration& declaration);

// That an optional method is not answered whose capability is not declared.
Case unknown_case(const char* name, stage::Method method);

std::vector<Question> space_questions(const PluginDeclaration& declaration, Draw* draw);
std::vector<Question> collision_questions(Subject& subject, Draw* draw);
std::vector<Question> moving_collision_questions(Subject& subject);
std::vector<Question> collision_geometry_questions(const PluginDeclaration& declaration);
std::vector<Question> space_geometry_questions(const PluginDeclaration& declaration);
std::vector<Question> constraint_questions(Subject& subject, Draw* draw);
std::vector<Question> coordinate_questions(Subject& subject, Draw* draw);
std::vector<Question> force_questions(Subject& subject, Draw* draw);
std::vector<Question> solver_questions(const PluginDeclaration& declaration, Draw* draw);
std::vector<Question> reaction_questions(const PluginDeclaration& declaration, Draw* draw);
std::vector<Question> integrator_questions(Draw* draw);

}  // namespace gravitas::conformance
