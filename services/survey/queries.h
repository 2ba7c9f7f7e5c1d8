// Rays, shape casts, overlap and closest points in a committed state (schemas/gravitas/query/v1/query.proto), for a
// program that runs an environment itself:
//
//   survey::Surveyor surveyor(description);
//   query::v1::Batch batch;                                   // and what is asked
//   const query::v1::Answers answers = survey::answer(&surveyor, environment, batch);
//
// The run is not touched (surveyor.h), whatever is asked and whoever dies of it: a state has the same answers on any
// hosting. Candidates come from bounds: of rays by the space slot, if the plan has one and its plugin the capability
// `rays`, else by the same rule here; the rest is the collision slot's, whether or not the plan leaves it out. Rays
// need its capability `rays`, casts `times_of_impact`.
#pragma once

#include <stdexcept>

#include "gravitas/query/v1/query.pb.h"
#include "services/survey/surveyor.h"

namespace gravitas::survey {

// What can never be answered, by the place in the batch ("rays[2].direction: …"), and what is allowed.
class BadQuestion : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Throws BadQuestion before anybody is asked, and NoAnswer.
query::v1::Answers answer(Surveyor* surveyor, const kernel::Environment& environment, const query::v1::Batch& batch);

}  // namespace gravitas::survey
