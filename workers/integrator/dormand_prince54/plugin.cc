// Integrator `DormandPrince54`: the Runge-Kutta pair of Dormand and Prince of orders 5 and 4 with error control
// (embedded_pair.h). The result is the one of order 5; the error is the difference of the two, e = h sum_i (b_i - b^_i) k_i.
// Sources: Dormand, Prince, J. Comput. Appl. Math. 6 (1980) 19; Hairer, Norsett, Wanner, Solving ODEs I, II.4, IV.2.
// Six derivatives an inner step and one more a step. Bodies that nothing touches take inner steps as long as Accuracy allows,
// whatever the step (DenseOutput): three derivatives a step there. Forces are then asked at states that the bodies would come
// to, up to an inner step ahead of what may stop them: one that has no value there needs DenseOutput = false.
// Damping as in motion_stages.h. Stability: explicit, so that a stiff force (h sqrt(k/m) > 3) costs as many inner steps as it
// takes; see Radau. Known failure: energy drifts by what the accuracy lets through. Below an accuracy of about 1e-7,
// DormandPrince853 is faster.
#include "plugin_sdk/embedded_pair.h"

namespace gravitas {
namespace {

struct Pair54 {
  static constexpr std::size_t kStages = 7, kErrorStages = 7;
  static constexpr double kNodes[kStages] = {0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0};
  static constexpr double kWeights[kStages][kStages - 1] = {
      {},
      {1.0 / 5.0},
      {3.0 / 40.0, 9.0 / 40.0},
      {44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0},
      {19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0},
      {9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0},
      {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0}};
  // of the dense output, of order 4
  static constexpr double kDense[kStages] = {-12715105075.0 / 11282082432.0,  0.0,
                                             87487479700.0 / 32700410799.0,   -10690763975.0 / 1880347072.0,
                                             701980252875.0 / 199316789632.0, -1453857185.0 / 822651844.0,
                                             69997945.0 / 29380423.0};
  static constexpr double kOrder = 5.0, kExponent = 0.17, kMemory = 0.04;

  static double error(const MotionStages<GroupChart>& stages, double h) {
    static constexpr double kError[kStages] = {71.0 / 57600.0,      0.0,          -71.0 / 16695.0, 71.0 / 1920.0,
                                               -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0};
    return largest_error(stages, kError, kNodes, h);
  }
};

class DormandPrince54 final : public EmbeddedPair<Pair54> {
 public:
  static PluginDeclaration declaration() {
    return {.name = "DormandPrince54",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Runge-Kutta pair of Dormand and Prince, order 5, with error control.",
            .capabilities = {"order=5", "plugin_state"},
            .properties = {accuracy_property(1e-8), dense_output_property()},
            .theta = 0.5};
  }
  using EmbeddedPair::EmbeddedPair;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::DormandPrince54)
