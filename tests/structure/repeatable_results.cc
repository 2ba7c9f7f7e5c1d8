#include "tests/structure/repeatable_results.h"

#include <cstddef>
#include <regex>
#include <string>

namespace gravitas::structure {
namespace {

struct Rule {
  std::regex pattern;
  std::string reason;
  bool holds_in_math;
};

const std::vector<Rule>& rules() {
  // as std::f(, ::f( with nothing in front, and __builtin_f(; also the variants for float and long
  // double
  static const std::string kLibm =
      "(a?(sin|cos|tan)h?|atan2|sincos|exp|exp2|expm1|log|log2|log10|log1p|pow|cbrt|hypot|erfc?|["
      "tl]gamma)[fl]?";
  static const std::vector<Rule> kRules = {
      {std::regex("(\\bstd::|(^|[^\\w>:])::|\\b__builtin_)" + kLibm + "\\s*\\("),
       "libm's result depends on the processor: use plugin_sdk/math/transcendental.h", false},
      {std::regex("\\b(AngleAxis[df]?|Rotation2D[df]?|angularDistance|slerp|eulerAngles)\\b"),
       "Eigen calls libm inside: use plugin_sdk/math/rotation.h", false},
      {std::regex("\\bstd::complex\\b|\\bMatrixXc[df]\\b|\\bVectorXc[df]\\b"),
       "its products and pivots call functions of the system: use real systems of twice the size", true},
      {std::regex("\\bunordered_(multi)?(map|set)\\b"), "its order depends on addresses: use an ordered container",
       true},
  };
  return kRules;
}

}  // namespace

std::vector<Finding> find_unrepeatable(const SourceTree& tree) {
  std::vector<Finding> findings;
  for (const std::string& path : tree.files) {
    const std::string room = room_of(path);
    if (!is_cpp(path) || (room != "kernel" && room != "plugin_sdk" && room != "workers")) continue;
    const bool math = path.starts_with("plugin_sdk/math/");
    const std::vector<std::string> lines = without_comments(lines_of(tree, path), Literals::kBlank);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      for (const Rule& rule : rules()) {
        std::smatch match;
        if ((math && !rule.holds_in_math) || !std::regex_search(lines[i], match, rule.pattern)) continue;
        findings.push_back({path, static_cast<int>(i) + 1, match[0].str() + ": " + rule.reason});
      }
    }
  }
  return findings;
}

}  // namespace gravitas::structure
