// Integrator `DormandPrince853`: the Runge-Kutta method of Dormand and Prince of order 8 with error control
// (embedded_pair.h) by two methods of orders 5 and 3 within it. With E5 and E3 the largest scaled differences from these,
//
//   E = E5 / sqrt(1 + (E3/E5)^2 / 100),
//
// which shrinks as h^8, as the error of the result does. Sources: Hairer, Norsett, Wanner, Solving ODEs I (1993), II.5
// and II.10, whose coefficients these are; Prince, Dormand, J. Comput. Appl. Math. 7 (1981) 67.
// Twelve derivatives an inner step and one more a step. Damping as in motion_stages.h. Stability: explicit, h sqrt(k/m)
// < 5.9, so that a stiff force costs as many inner steps as it takes; see Radau. Known failure: energy drifts by what the
// accuracy lets through; where forces are not smooth, or at an accuracy above about 1e-7, DormandPrince54 is faster. Nodes that go
// back (1/3 to 1/4) let inner steps with a damping d be no longer than some tens of 1/d where forces change.
#include "plugin_sdk/embedded_pair.h"

namespace gravitas {
namespace {

struct Pair853 {
  static constexpr std::size_t kStages = 13, kErrorStages = 12;
  static constexpr double kNodes[kStages] = {0.0,
                                             0.526001519587677318785587544488e-1,
                                             0.789002279381515978178381316732e-1,
                                             0.118350341907227396726757197510,
                                             0.281649658092772603273242802490,
                                             1.0 / 3.0,
                                             0.25,
                                             4.0 / 13.0,
                                             127.0 / 195.0,
                                             0.6,
                                             6.0 / 7.0,
                                             1.0,
                                             1.0};
  static constexpr double kWeights[kStages][kStages - 1] = {
      {},
      {5.26001519587677318785587544488e-2},
      {1.97250569845378994544595329183e-2, 5.91751709536136983633785987549e-2},
      {2.95875854768068491816892993775e-2, 0.0, 8.87627564304205475450678981324e-2},
      {2.41365134159266685502369798665e-1, 0.0, -8.84549479328286085344864962717e-1,
       9.24834003261792003115737966543e-1},
      {1.0 / 27.0, 0.0, 0.0, 1.70828608729473871279604482173e-1, 1.25467687566822425016691814123e-1},
      {3.7109375e-2, 0.0, 0.0, 1.70252211019544039314978060272e-1, 6.02165389804559606850219397283e-2, -1.7578125e-2},
      {3.70920001185047927108779319836e-2, 0.0, 0.0, 1.70383925712239993810214054705e-1,
       1.07262030446373284651809199168e-1, -1.53194377486244017527936158236e-2, 8.27378916381402288758473766002e-3},
      {6.24110958716075717114429577812e-1, 0.0, 0.0, -3.36089262944694129406857109825,
       -8.68219346841726006818189891453e-1, 2.75920996994467083049415600797e1, 2.01540675504778934086186788979e1,
       -4.34898841810699588477366255144e1},
      {4.77662536438264365890433908527e-1, 0.0, 0.0, -2.48811461997166764192642586468,
       -5.90290826836842996371446475743e-1, 2.12300514481811942347288949897e1, 1.52792336328824235832596922938e1,
       -3.32882109689848629194453265587e1, -2.03312017085086261358222928593e-2},
      {-9.3714243008598732571704021658e-1, 0.0, 0.0, 5.18637242884406370830023853209, 1.09143734899672957818500254654,
       -8.14978701074692612513997267357, -1.85200656599969598641566180701e1, 2.27394870993505042818970056734e1,
       2.49360555267965238987089396762, -3.0467644718982195003823669022},
      {2.27331014751653820792359768449, 0.0, 0.0, -1.05344954667372501984066689879e1, -2.00087205822486249909675718444,
       -1.79589318631187989172765950534e1, 2.79488845294199600508499808837e1, -2.85899827713502369474065508674,
       -8.87285693353062954433549289258, 1.23605671757943030647266201528e1, 6.43392746015763530355970484046e-1},
      {5.42937341165687622380535766363e-2, 0.0, 0.0, 0.0, 0.0, 4.45031289275240888144113950566,
       1.89151789931450038304281599044, -5.8012039600105847814672114227, 3.1116436695781989440891606237e-1,
       -1.52160949662516078556178806805e-1, 2.01365400804030348374776537501e-1, 4.47106157277725905176885569043e-2}};
  static constexpr double kOrder = 8.0, kExponent = 1.0 / 8.0, kMemory = 0.0;

  static double error(const MotionStages<GroupChart>& stages, double h) {
    static constexpr double kFifth[kErrorStages] = {0.1312004499419488073250102996e-1,
                                                    0.0,
                                                    0.0,
                                                    0.0,
                                                    0.0,
                                                    -0.1225156446376204440720569753e+1,
                                                    -0.4957589496572501915214079952,
                                                    0.1664377182454986536961530415e+1,
                                                    -0.3503288487499736816886487290,
                                                    0.3341791187130174790297318841,
                                                    0.8192320648511571246570742613e-1,
                                                    -0.2235530786388629525884427845e-1};
    static constexpr auto& kEighth = kWeights[kStages - 1];
    // b of order 3: 0.244..., 0.733..., 0.022... at the first, ninth and last stage
    static constexpr double kThird[kErrorStages] = {kEighth[0] - 0.244094488188976377952755905512,
                                                    0.0,
                                                    0.0,
                                                    0.0,
                                                    0.0,
                                                    kEighth[5],
                                                    kEighth[6],
                                                    kEighth[7],
                                                    kEighth[8] - 0.733846688281611857341361741547,
                                                    kEighth[9],
                                                    kEighth[10],
                                                    kEighth[11] - 0.220588235294117647058823529412e-1};
    const double fifth = largest_error(stages, kFifth, kNodes, h), third = largest_error(stages, kThird, kNodes, h);
    if (!std::isfinite(fifth) || !std::isfinite(third)) return HUGE_VAL;
    const double share = fifth > 0.0 ? third / fifth : 0.0;
    return fifth / std::sqrt(1.0 + 0.01 * share * share);
  }
};

class DormandPrince853 final : public EmbeddedPair<Pair853> {
 public:
  static PluginDeclaration declaration() {
    return {.name = "DormandPrince853",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Runge-Kutta method of Dormand and Prince, order 8, with error control: for high accuracy.",
            .capabilities = {"order=8", "plugin_state"},
            .properties = {accuracy_property(1e-10)},
            .theta = 0.5};
  }
  using EmbeddedPair::EmbeddedPair;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::DormandPrince853)
