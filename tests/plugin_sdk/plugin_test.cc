// From an author's class to the C table and back: what is declared arrives, what is thrown becomes
// a status and a text, and a column without room is counted.
#include "plugin_sdk/plugin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "plugin_sdk/floating_point.h"
#include "plugin_sdk/library.h"
#include "tests/plugin_sdk/declaration_equality.h"

namespace gravitas {
namespace {

using Pairs = std::function<void(const stage::SpacePairsRequest&, const stage::SpacePairsReply&, Host&)>;

int alive = 0;

// A space whose answer is what the test says.
class Toy : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Toy",
            .version = "1.0",
            .slot = Slot::kSpace,
            .meaning = "Answers what a test says.",
            .properties = {Property::number("Number", "1").at_most(1000.0).means("Is remembered.")}};
  }
  explicit Toy(PropertyCursor settings) : number(settings.number()) {
    if (number < 0.0) throw Refusal("a negative number");
    if (number == 1000.0) throw 1000;
    ++alive;
  }
  ~Toy() override { --alive; }
  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host) override {
    answer(request, reply, host);
  }

  double number;
  Pairs answer;
};

class Described final : public Toy {
 public:
  static PluginDeclaration declaration() { return test::full_declaration(); }
  using Toy::Toy;
};

// A call of Space.Pairs with room for four numbers.
struct Call {
  std::int32_t make(const Pairs& answer, std::uint32_t method = 0) {
    std::vector<double> settings = {1.0};
    void* instance = nullptr;
    const gravitas_plugin_table& table = *plugin_table<Toy>();
    EXPECT_EQ(table.create(settings.data(), settings.size(), &instance, &error), GRAVITAS_OK);
    static_cast<Toy*>(instance)->answer = answer;
    const std::int32_t status = table.call(instance, method, request.data(), &reply, &host, &error);
    table.destroy(instance);
    return status;
  }

  std::array<std::uint32_t, 6> numbers = {9, 9, 9, 9, 9, 9};
  std::array<gravitas_column, 5> request = {};
  gravitas_reply_column reply = {numbers.data(), 4, 0};
  gravitas_host host = {};
  gravitas_error error = {};
};

TEST(PluginTable, SaysWhatItWasBuiltFor) {
  const gravitas_plugin_table& table = *plugin_table<Toy>();
  EXPECT_EQ(table.magic, GRAVITAS_MAGIC);
  EXPECT_EQ(table.abi_version, static_cast<std::uint32_t>(GRAVITAS_ABI_VERSION));
  EXPECT_EQ(table.layout_version, static_cast<std::uint32_t>(GRAVITAS_LAYOUT_VERSION));
  EXPECT_EQ(table.schema_hash, stage::kSchemaHash);
  EXPECT_STREQ(table.build_id, GRAVITAS_BUILD_ID);
  EXPECT_EQ(plugin_table<Toy>(), &table);
}

TEST(PluginTable, CarriesTheWholeDeclaration) {
  test::expect_equal(read_declaration(*plugin_table<Described>()->description), test::full_declaration());
}

TEST(PluginTable, CreatesAndDestroysInstances) {
  const std::vector<double> settings = {2.5};
  void *first = nullptr, *second = nullptr;
  gravitas_error error{};
  const gravitas_plugin_table& table = *plugin_table<Toy>();
  ASSERT_EQ(table.create(settings.data(), 1, &first, &error), GRAVITAS_OK);
  ASSERT_EQ(table.create(settings.data(), 1, &second, &error), GRAVITAS_OK);
  EXPECT_NE(first, second);
  EXPECT_EQ(static_cast<Toy*>(second)->number, 2.5);
  EXPECT_EQ(alive, 2);
  table.destroy(first);
  table.destroy(second);
  EXPECT_EQ(alive, 0);
}

TEST(PluginTable, SaysWhyAnInstanceCannotBe) {
  const auto create = [](std::vector<double> settings, std::string* text) {
    void* instance = nullptr;
    gravitas_error error{};
    const std::int32_t status = plugin_table<Toy>()->create(settings.data(), settings.size(), &instance, &error);
    EXPECT_EQ(instance, nullptr);
    *text = error.text;
    return status;
  };
  std::string text;
  EXPECT_EQ(create({-1.0}, &text), GRAVITAS_REFUSED);
  EXPECT_EQ(text, "a negative number");
  EXPECT_EQ(create({}, &text), GRAVITAS_REFUSED);
  EXPECT_EQ(text, "settings of Toy: fewer numbers than the properties take");
  EXPECT_EQ(create({1.0, 2.0}, &text), GRAVITAS_REFUSED);
  EXPECT_EQ(text, "settings of Toy: more numbers than the properties take");
  EXPECT_EQ(create({1001.0}, &text), GRAVITAS_REFUSED);
  EXPECT_EQ(text, "settings of Toy: Number = 1001; allowed: a number <= 1000");
  EXPECT_EQ(create({1000.0}, &text), GRAVITAS_FAILED);
  EXPECT_EQ(text, "an exception that is no std::exception");
  EXPECT_EQ(alive, 0);
}

TEST(PluginCall, AnAnswerIsOk) {
  Call call;
  EXPECT_EQ(call.make([](auto&, const auto& reply, auto&) { reply.pair().push(1, 2); }), GRAVITAS_OK);
  EXPECT_EQ(call.reply.count, 2U);
  EXPECT_EQ(call.numbers, (std::array<std::uint32_t, 6>{1, 2, 9, 9, 9, 9}));
  EXPECT_STREQ(call.error.text, "");
}

TEST(PluginCall, ARequestArrivesColumnByColumn) {
  Call call;
  const std::array<double, 3> lower = {-1, -2, -3};
  const std::array<std::uint32_t, 1> flags = {5};
  call.request[stage::SpacePairsRequest::kLower] = {lower.data(), 3};
  call.request[stage::SpacePairsRequest::kFlags] = {flags.data(), 1};
  EXPECT_EQ(call.make([&](const auto& request, auto&, auto&) {
    EXPECT_EQ(request.lower().data(), lower.data());
    EXPECT_EQ(request.lower().size(), 3U);
    EXPECT_EQ(request.flags()[0], 5U);
    EXPECT_TRUE(request.filter_mask().empty());
  }),
            GRAVITAS_OK);
}

TEST(PluginCall, AColumnWithoutRoomIsCountedAndNotOverrun) {
  Call call;
  const Pairs three = [](auto&, const auto& reply, auto&) {
    for (std::uint32_t i = 0; i < 3; ++i) reply.pair().push(i, i + 1);
  };
  EXPECT_EQ(call.make(three), GRAVITAS_NEEDS_CAPACITY);
  EXPECT_EQ(call.reply.count, 6U);
  EXPECT_EQ(call.numbers, (std::array<std::uint32_t, 6>{0, 1, 1, 2, 9, 9}));
  // asked again with the room it said it takes
  call.reply = {call.numbers.data(), call.reply.count, 0};
  EXPECT_EQ(call.make(three), GRAVITAS_OK);
  EXPECT_EQ(call.numbers, (std::array<std::uint32_t, 6>{0, 1, 1, 2, 2, 3}));
}

TEST(PluginCall, ARefusalIsAStatusAndAText) {
  Call call;
  EXPECT_EQ(call.make([](auto&, auto&, auto&) { throw Refusal("no such body"); }), GRAVITAS_REFUSED);
  EXPECT_STREQ(call.error.text, "no such body");
  EXPECT_EQ(call.make([](auto&, auto&, auto&) { PropertyCursor({}).number(); }), GRAVITAS_REFUSED);
  EXPECT_STREQ(call.error.text, "fewer numbers than the declared properties take");
}

TEST(PluginCall, AnExceptionIsAFailureAndAText) {
  Call call;
  EXPECT_EQ(call.make([](auto&, auto&, auto&) { throw std::runtime_error("out of ideas"); }), GRAVITAS_FAILED);
  EXPECT_STREQ(call.error.text, "out of ideas");
  EXPECT_EQ(call.make([](auto&, auto&, auto&) { throw 7; }), GRAVITAS_FAILED);
  EXPECT_STREQ(call.error.text, "an exception that is no std::exception");
  EXPECT_EQ(alive, 0);
}

TEST(PluginCall, ALongTextIsCutAndEnds) {
  Call call;
  const std::string text(2000, 'x');
  std::memset(call.error.text, '!', sizeof call.error.text);
  EXPECT_EQ(call.make([&](auto&, auto&, auto&) { throw Refusal(text); }), GRAVITAS_REFUSED);
  EXPECT_EQ(call.error.text, text.substr(0, sizeof call.error.text - 1));
}

TEST(PluginCall, AnOptionalMethodThatIsNotOverriddenIsUnknown) {
  Call call;
  EXPECT_EQ(call.make([](auto&, auto&, auto&) { throw UnknownMethod(); }), GRAVITAS_UNKNOWN_METHOD);
  EXPECT_STREQ(call.error.text, "the plugin does not answer this method");
}

TEST(PluginCall, AnotherMethodIsUnknown) {
  const Pairs never = [](auto&, auto&, auto&) { FAIL(); };
  for (std::uint32_t method = 1; method < stage::kMethodCount + 2; ++method) {
    Call call;
    EXPECT_EQ(call.make(never, method), GRAVITAS_UNKNOWN_METHOD) << method;
  }
}

// ---- host ---------------------------------------------------------------------------------------

TEST(PluginHost, PassesMarksOfProgressOn) {
  int marks = 0;
  Call call;
  call.host.context = &marks;
  call.host.mark_progress = [](void* context) { ++*static_cast<int*>(context); };
  EXPECT_EQ(call.make([](auto&, auto&, const Host& host) {
    for (int i = 0; i < 5; ++i) host.mark_progress();
  }),
            GRAVITAS_OK);
  EXPECT_EQ(marks, 5);
}

TEST(PluginHost, PassesTheBodyOfALoopOn) {
  Call call;
  call.host.parallel_for = [](void*, std::uint64_t count, void (*body)(void*, std::uint64_t, std::uint64_t),
                              void* argument) {
    body(argument, 0, count / 2);
    body(argument, count / 2, count);
  };
  std::vector<std::uint64_t> borders;
  EXPECT_EQ(call.make([&](auto&, auto&, const Host& host) {
    host.parallel_for(10, [&](std::uint64_t begin, std::uint64_t end) { borders.insert(borders.end(), {begin, end}); });
  }),
            GRAVITAS_OK);
  EXPECT_EQ(borders, (std::vector<std::uint64_t>{0, 5, 5, 10}));
}

TEST(PluginHost, ADerivativeThatCannotBeHadFailsTheCall) {
  const Pairs ask = [](auto&, auto&, const Host& host) { host.derivative(nullptr, nullptr); };
  Call call;
  EXPECT_EQ(call.make(ask), GRAVITAS_FAILED);
  EXPECT_STREQ(call.error.text, "the derivative could not be had");
  call.host.derivative = [](void*, const gravitas_column*, gravitas_reply_column*) -> std::int32_t {
    return GRAVITAS_CALLBACK_FAILED;
  };
  EXPECT_EQ(call.make(ask), GRAVITAS_FAILED);
  call.host.derivative = [](void*, const gravitas_column*, gravitas_reply_column*) -> std::int32_t {
    return GRAVITAS_OK;
  };
  EXPECT_EQ(call.make(ask), GRAVITAS_OK);
}

// ---- slots --------------------------------------------------------------------------------------

std::string asked;

class ToyCollision final : public CollisionPlugin {
  void manifolds(const stage::CollisionManifoldsRequest&, const stage::CollisionManifoldsReply&, Host&) override {
    asked += "manifolds ";
  }
};
class MovingCollision final : public CollisionPlugin {
  void manifolds(const stage::CollisionManifoldsRequest&, const stage::CollisionManifoldsReply&, Host&) override {
    asked += "manifolds ";
  }
  void times_of_impact(const stage::CollisionTimesOfImpactRequest&, const stage::CollisionTimesOfImpactReply&,
                       Host&) override {
    asked += "times_of_impact ";
  }
  void rays(const stage::CollisionRaysRequest&, const stage::CollisionRaysReply&, Host&) override { asked += "rays "; }
  void debug_geometry(const stage::CollisionDebugGeometryRequest&, const stage::CollisionDebugGeometryReply&,
                      Host&) override {
    asked += "debug_geometry ";
  }
};
class ToySpace final : public SpacePlugin {
  void pairs(const stage::SpacePairsRequest&, const stage::SpacePairsReply&, Host&) override { asked += "pairs "; }
};
class RaySpace final : public SpacePlugin {
  void pairs(const stage::SpacePairsRequest&, const stage::SpacePairsReply&, Host&) override { asked += "pairs "; }
  void rays(const stage::SpaceRaysRequest&, const stage::SpaceRaysReply&, Host&) override { asked += "rays "; }
  void debug_geometry(const stage::SpacePairsRequest&, const stage::SpaceDebugGeometryReply&, Host&) override {
    asked += "debug_geometry ";
  }
};
class ToyConstraint final : public ConstraintPlugin {
  void bind(const stage::ConstraintBindRequest&, const stage::ConstraintBindReply&, Host&) override {
    asked += "bind ";
  }
  void discrepancies(const stage::ConstraintDiscrepanciesRequest&, const stage::ConstraintDiscrepanciesReply&,
                     Host&) override {
    asked += "discrepancies ";
  }
};
class ToldConstraint final : public ConstraintPlugin {
  void bind(const stage::ConstraintBindRequest&, const stage::ConstraintBindReply&, Host&) override {
    asked += "bind ";
  }
  void discrepancies(const stage::ConstraintDiscrepanciesRequest&, const stage::ConstraintDiscrepanciesReply&,
                     Host&) override {
    asked += "discrepancies ";
  }
  void coordinates(const stage::ConstraintDiscrepanciesRequest&, const stage::ConstraintCoordinatesReply&,
                   Host&) override {
    asked += "coordinates ";
  }
};
class ToyForce final : public ForcePlugin {
  void wrenches(const stage::ForceWrenchesRequest&, const stage::ForceWrenchesReply&, Host&) override {
    asked += "wrenches ";
  }
};
class ToySolver final : public SolverPlugin {
  void solve(const stage::SolverSolveRequest&, const stage::SolverSolveReply&, Host&) override { asked += "solve "; }
  void reactions(const stage::SolverReactionsRequest&, const stage::SolverReactionsReply&, Host&) override {
    asked += "reactions ";
  }
};
class SlopedSolver final : public SolverPlugin {
  void solve(const stage::SolverSolveRequest&, const stage::SolverSolveReply&, Host&) override { asked += "solve "; }
  void reactions(const stage::SolverReactionsRequest&, const stage::SolverReactionsReply&, Host&) override {
    asked += "reactions ";
  }
  void reaction_jacobians(const stage::SolverReactionsRequest&, const stage::SolverReactionJacobiansReply&,
                          Host&) override {
    asked += "reaction_jacobians ";
  }
};
class ToyIntegrator final : public IntegratorPlugin {
  void integrate(const stage::IntegratorIntegrateRequest&, const stage::IntegratorIntegrateReply&, Host&) override {
    asked += "integrate ";
  }
};

// What a plugin was asked when every method was tried, and how many methods it knew.
template <typename P>
std::pair<std::string, int> try_every_method() {
  asked.clear();
  P plugin;
  const gravitas_host none{};
  Host host(&none);
  int known = 0;
  for (std::uint32_t method = 0; method < stage::kMethodCount; ++method) {
    try {
      known += plugin.dispatch(static_cast<stage::Method>(method), nullptr, nullptr, host) ? 1 : 0;
    } catch (const UnknownMethod&) {
      asked += "(not the optional one) ";
    }
  }
  return {asked, known};
}

TEST(PluginSlots, EachAnswersItsOwnQuestionsOnly) {
  using Answer = std::pair<std::string, int>;
  const std::string none = "(not the optional one) ";
  EXPECT_EQ(try_every_method<ToySpace>(), Answer("pairs " + none + none, 1));
  EXPECT_EQ(try_every_method<RaySpace>(), Answer("pairs rays debug_geometry ", 3));
  EXPECT_EQ(try_every_method<ToyCollision>(), Answer("manifolds " + none + none + none, 1));
  EXPECT_EQ(try_every_method<MovingCollision>(), Answer("manifolds times_of_impact rays debug_geometry ", 4));
  EXPECT_EQ(try_every_method<ToyConstraint>(), Answer("bind discrepancies " + none, 2));
  EXPECT_EQ(try_every_method<ToldConstraint>(), Answer("bind discrepancies coordinates ", 3));
  EXPECT_EQ(try_every_method<ToyForce>(), Answer("wrenches " + none, 1));
  EXPECT_EQ(try_every_method<ToySolver>(), Answer("solve reactions " + none, 2));
  EXPECT_EQ(try_every_method<SlopedSolver>(), Answer("solve reactions reaction_jacobians ", 3));
  EXPECT_EQ(try_every_method<ToyIntegrator>(), Answer("integrate ", 1));
}

TEST(PluginSlots, HaveTheNamesOfTheirFolders) {
  EXPECT_STREQ(slot_name(Slot::kSpace), "space");
  EXPECT_STREQ(slot_name(Slot::kCollision), "collision");
  EXPECT_STREQ(slot_name(Slot::kConstraint), "constraint");
  EXPECT_STREQ(slot_name(Slot::kForce), "force");
  EXPECT_STREQ(slot_name(Slot::kSolver), "solver");
  EXPECT_STREQ(slot_name(Slot::kIntegrator), "integrator");
  EXPECT_STREQ(slot_name(static_cast<Slot>(99)), "unknown");
}

TEST(SetError, CutsALongTextBeforeAWholeCharacter) {
  gravitas_error error{};
  std::string text;
  for (int i = 0; i < 300; ++i) text += "\xc3\xa4";
  detail::set_error(&error, text.c_str());
  EXPECT_EQ(error.text, text.substr(0, 510));
  detail::set_error(&error, ("x" + text).c_str());
  EXPECT_EQ(error.text, "x" + text.substr(0, 510));
  detail::set_error(&error, std::string(511, 'y').c_str());
  EXPECT_EQ(error.text, std::string(511, 'y'));
}

}  // namespace
}  // namespace gravitas
