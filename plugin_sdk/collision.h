// What every collision plugin does with its request and reply beside geometry: rows checked, poses composed, contacts
// written with their velocities. All throw Refusal with the reason.
#pragma once

#include <span>

#include "plugin_sdk/body.h"
#include "plugin_sdk/geometry/manifold.h"
#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/plugin.h"

namespace gravitas::collision {

// The flattened properties of a shape.
std::span<const double> shape_parameters(const stage::CollisionManifoldsRequest& request, std::size_t shape);

// The pairs name bodies with shapes, the margin is one, and every number of a body is finite.
void check_bodies(const stage::CollisionManifoldsRequest& request);

// The pose of a body's shape in the world.
Pose geometry_pose(const stage::CollisionManifoldsRequest& request, std::uint32_t body);

// Appends a contact of a pair, with the velocity of b relative to a at its point.
void write_contact(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                   std::size_t pair, const ContactPoint& contact);

}  // namespace gravitas::collision
