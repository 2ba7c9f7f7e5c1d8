// The stored numbers of transcendental.cc: bits of 2/pi, and pairs hi + lo of logarithms and
// arctangents. They are literals, not computed at start-up, so that every build and every machine
// has the same bits; the tests derive the logarithms and arctangents again in quadruple precision
// and try the bits of 2/pi with an argument of every exponent.
#pragma once

#include <cstdint>

namespace gravitas::math {

// The fraction bits of 2/pi, most significant first, after one word of zeros that lets a window
// start up to 64 bits before the binary point. 1280 bits reach past the largest double:
// 2^1024 * (2/pi) needs 1024 + 190 of them.
inline constexpr std::uint64_t kTwoOverPiBits[] = {
    0x0000000000000000, 0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561,
    0xb7246e3a424dd2e0, 0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484, 0xe99c7026b45f7e41,
    0x3991d639835339f4, 0x9c845f8bbdf9283b, 0x1ff897ffde05980f, 0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7,
    0x4f463f669e5fea2d, 0x7527bac7ebe5f17b, 0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab,
    0xf0cfbc209af4361d,
};

// Row i covers mantissas m in [1, 2) near c = 1 + i/64; from row kLogHalvedFrom on, m and c are
// halved, so that the reduced argument lies in [0.707, 1.414] and no cancellation against the
// exponent's part occurs.
struct LogRow {
  double reciprocal;  // 1/c rounded to 2^-20
  double log_hi;      // -log(reciprocal) rounded to a multiple of 2^-42
  double log_lo;      // the rest
};
inline constexpr int kLogHalvedFrom = 27;
inline constexpr LogRow kLogTable[] = {
    {0x1.0000000000000p+0, 0x0.0p+0, 0x0.0p+0},
    {0x1.f81f800000000p-1, 0x1.fc0b0b0fc0000p-7, 0x1.f8f3e86147e01p-49},
    {0x1.f07c200000000p-1, 0x1.f82990e780000p-6, 0x1.9c0267c68b48fp-45},
    {0x1.e913200000000p-1, 0x1.7745376330000p-5, -0x1.b73b9d8eab34ap-45},
    {0x1.e1e1e00000000p-1, 0x1.f0a32c0118000p-5, -0x1.c599e828be3e6p-45},
    {0x1.dae6000000000p-1, 0x1.341db961bc000p-4, 0x1.9d092aed8cba6p-44},
    {0x1.d41d400000000p-1, 0x1.6f0d38ae58000p-4, -0x1.434641b10f0bdp-44},
    {0x1.cd85600000000p-1, 0x1.a9271fa4b0000p-4, -0x1.f549ad0747f8fp-44},
    {0x1.c71c800000000p-1, 0x1.e26ff6e2b0000p-4, 0x1.2e5e93fdd5937p-44},
    {0x1.c0e0800000000p-1, 0x1.0d779fcd0a000p-3, 0x1.4cb30ef8beba7p-46},
    {0x1.bacfa00000000p-1, 0x1.2954eb8200000p-3, 0x1.ccd2e7e07238fp-45},
    {0x1.b4e8200000000p-1, 0x1.44d2a0ccb8000p-3, -0x1.fb305f3c08ab6p-48},
    {0x1.af28600000000p-1, 0x1.5ff33f0a7a000p-3, 0x1.3c8ad0cb5ddecp-51},
    {0x1.a98f000000000p-1, 0x1.7ab860210e000p-3, 0x1.048ddfb597060p-46},
    {0x1.a41a400000000p-1, 0x1.9525b1cf46000p-3, -0x1.217137d49c039p-44},
    {0x1.9ec8e00000000p-1, 0x1.af3cc2e80c000p-3, 0x1.06db1dc1ede2cp-44},
    {0x1.9999a00000000p-1, 0x1.c8ff5c79aa000p-3, -0x1.de53e4d28b97bp-47},
    {0x1.948b000000000p-1, 0x1.e270c6e2b0000p-3, 0x1.7cbd522655eddp-44},
    {0x1.8f9c200000000p-1, 0x1.fb9162d5e4000p-3, 0x1.9d46a30b36357p-46},
    {0x1.8acba00000000p-1, 0x1.0a3227273a000p-2, -0x1.9d506ca2aed96p-45},
    {0x1.8618600000000p-1, 0x1.1675cebaba000p-2, 0x1.8b80e7374ab1ap-44},
    {0x1.8181800000000p-1, 0x1.229423bcf8000p-2, -0x1.9e976f595b40dp-44},
    {0x1.7d06000000000p-1, 0x1.2e8e0bae12000p-2, 0x1.4c2700879c369p-44},
    {0x1.78a4c00000000p-1, 0x1.3a64db5695000p-2, -0x1.938e30bb373f6p-44},
    {0x1.745d200000000p-1, 0x1.4618a421c6000p-2, 0x1.a13e7cbd9c022p-45},
    {0x1.702e000000000p-1, 0x1.51aae872e0000p-2, -0x1.74bd8c5b5272cp-44},
    {0x1.6c16c00000000p-1, 0x1.5d1bdff581000p-2, -0x1.856bdc9726ce2p-44},
    {0x1.6816800000000p+0, -0x1.5d5bd9f596000p-2, 0x1.e0b2a0b4f1089p-47},
    {0x1.642c800000000p+0, -0x1.522ad0738a000p-2, -0x1.d7ce0ad74385dp-46},
    {0x1.6058100000000p+0, -0x1.4718caa71c000p-2, -0x1.b68637d88fc52p-46},
    {0x1.5c98800000000p+0, -0x1.3c251f7333000p-2, -0x1.03b54ab5c12a2p-46},
    {0x1.58ed200000000p+0, -0x1.314f151d36000p-2, 0x1.df27adab93cc5p-45},
    {0x1.5555500000000p+0, -0x1.269611134e000p-2, 0x1.9b61f25a77bbap-44},
    {0x1.51d0800000000p+0, -0x1.1bf99a35a7000p-2, 0x1.22c895706cbcfp-44},
    {0x1.4e5e100000000p+0, -0x1.1178f9227e000p-2, -0x1.1cef1cf876496p-45},
    {0x1.4afd700000000p+0, -0x1.07139884d5000p-2, -0x1.6d7cdd268ff21p-44},
    {0x1.47ae100000000p+0, -0x1.f991aacb3c000p-3, 0x1.f2d04dbc77304p-44},
    {0x1.446f800000000p+0, -0x1.e530c7fe70000p-3, -0x1.3a4242515d8a1p-44},
    {0x1.4141400000000p+0, -0x1.d103772656000p-3, 0x1.c4a7e7861a190p-47},
    {0x1.3e22d00000000p+0, -0x1.bd088e83be000p-3, 0x1.457e21fd9897bp-44},
    {0x1.3b13b00000000p+0, -0x1.a93ecbc8ae000p-3, 0x1.972435100cc14p-45},
    {0x1.3813800000000p+0, -0x1.95a5a5cf70000p-3, -0x1.3f22855f654c3p-47},
    {0x1.3521d00000000p+0, -0x1.823c18551a000p-3, -0x1.deddb9a6873d8p-46},
    {0x1.323e300000000p+0, -0x1.6f0109b756000p-3, -0x1.bea71f3998859p-45},
    {0x1.2f68500000000p+0, -0x1.5bf422b544000p-3, 0x1.57811d91ef704p-45},
    {0x1.2c9fb00000000p+0, -0x1.4913b7333c000p-3, 0x1.dc0436ce6a50cp-44},
    {0x1.29e4100000000p+0, -0x1.365fb90158000p-3, -0x1.da45f4c7a96dfp-44},
    {0x1.2735100000000p+0, -0x1.23d731a49c000p-3, 0x1.bf5b8452eedb5p-47},
    {0x1.2492500000000p+0, -0x1.117918227e000p-3, 0x1.21086a1d2fa96p-45},
    {0x1.21fb800000000p+0, -0x1.fe89839dbc000p-4, 0x1.8d355abd9940ap-47},
    {0x1.1f70400000000p+0, -0x1.da72063844000p-4, 0x1.1ddb06a6b91e1p-44},
    {0x1.1cf0700000000p+0, -0x1.b6acd2dad4000p-4, -0x1.069e015fc4fffp-44},
    {0x1.1a7b900000000p+0, -0x1.93358dd594000p-4, 0x1.65d48685ac935p-46},
    {0x1.1811800000000p+0, -0x1.700d20aeac000p-4, -0x1.83d1b3de684ffp-50},
    {0x1.15b1e00000000p+0, -0x1.4d30bdd208000p-4, 0x1.073a28fa4a459p-44},
    {0x1.135c800000000p+0, -0x1.2aa03a4470000p-4, -0x1.7248ba85c75ecp-44},
    {0x1.1111100000000p+0, -0x1.08597b59e4000p-4, 0x1.9e5dd715ee582p-46},
    {0x1.0ecf500000000p+0, -0x1.ccb670ddd8000p-5, -0x1.44f0c5eb5d185p-46},
    {0x1.0c97100000000p+0, -0x1.894a0949f8000p-5, -0x1.cb334d0604118p-45},
    {0x1.0a68100000000p+0, -0x1.466ad942e0000p-5, 0x1.c7a7375e7a7d3p-45},
    {0x1.0842100000000p+0, -0x1.0415c89e78000p-5, 0x1.dfdc7f46c6fc0p-44},
    {0x1.0624e00000000p+0, -0x1.8493028c90000p-6, 0x1.1185d123e5b7ep-44},
    {0x1.0410400000000p+0, -0x1.0205258930000p-6, -0x1.591d27c392ec1p-44},
    {0x1.0204100000000p+0, -0x1.0105475880000p-7, 0x1.99ed21ce675dcp-47},
    {0x1.0000000000000p+0, 0x0.0p+0, 0x0.0p+0},
};

// atan(k/8) = hi + lo for k = 0..8.
struct AtanRow {
  double hi;
  double lo;
};
inline constexpr AtanRow kAtanTable[] = {
    {0x0.0p+0, 0x0.0p+0},
    {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
    {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
    {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
    {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
    {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
    {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
    {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
    {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55},
};

}  // namespace gravitas::math
