// What the system plugin of an export asks of Gazebo, in the form that Gazebo has it: one link,
// whose state the stand-in holds. Names and frames are Gazebo's; nothing of Gazebo is in it.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace sdf {
struct Element {
  template <class T>
  std::pair<T, bool> Get(const std::string&, const T& otherwise) const {
    return {otherwise, false};
  }
};
} // namespace sdf

namespace gz::math {
class Vector3d {
public:
  Vector3d(double x, double y, double z) : x_(x), y_(y), z_(z) {}
  double X() const { return x_; }
  double Y() const { return y_; }
  double Z() const { return z_; }
  static const Vector3d Zero;

private:
  double x_, y_, z_;
};
inline const Vector3d Vector3d::Zero{0, 0, 0};

class Quaterniond {
public:
  explicit Quaterniond(double yaw) : yaw_(yaw) {}
  double Yaw() const { return yaw_; }

private:
  double yaw_;
};

class Pose3d {
public:
  Pose3d(const Vector3d& place, const Quaterniond& turn) : place_(place), turn_(turn) {}
  const Vector3d& Pos() const { return place_; }
  const Quaterniond& Rot() const { return turn_; }

private:
  Vector3d place_;
  Quaterniond turn_;
};
} // namespace gz::math

namespace gz::sim {
using Entity = std::uint64_t;
inline constexpr Entity kNullEntity = 0;

// The state of the one link, and what acts on it in this step.
struct EntityComponentManager {
  double x, y, yaw, vx, vy, spin;
  double force_x, force_y, torque;
  bool velocities;
};
struct EventManager {};

struct UpdateInfo {
  std::chrono::steady_clock::duration simTime{0}, dt{0};
  bool paused = false;
};

struct System {
  virtual ~System() = default;
};
struct ISystemConfigure {
  virtual void Configure(const Entity&, const std::shared_ptr<const sdf::Element>&,
                         EntityComponentManager&, EventManager&) = 0;
};
struct ISystemPreUpdate {
  virtual void PreUpdate(const UpdateInfo&, EntityComponentManager&) = 0;
};

class Link {
public:
  explicit Link(Entity entity) : entity_(entity) {}
  bool Valid(const EntityComponentManager&) const { return entity_ != kNullEntity; }
  void EnableVelocityChecks(EntityComponentManager& components, bool enable) const {
    components.velocities = enable;
  }
  std::optional<math::Pose3d> WorldPose(const EntityComponentManager& c) const {
    return math::Pose3d({c.x, c.y, 0}, math::Quaterniond(c.yaw));
  }
  std::optional<math::Vector3d> WorldLinearVelocity(const EntityComponentManager& c) const {
    return c.velocities ? std::optional(math::Vector3d(c.vx, c.vy, 0)) : std::nullopt;
  }
  std::optional<math::Vector3d> WorldAngularVelocity(const EntityComponentManager& c) const {
    return c.velocities ? std::optional(math::Vector3d(0, 0, c.spin)) : std::nullopt;
  }
  void AddWorldWrench(EntityComponentManager& components, const math::Vector3d& force,
                      const math::Vector3d& torque) const {
    components.force_x += force.X();
    components.force_y += force.Y();
    components.torque += torque.Z();
  }

private:
  Entity entity_;
};

class Model {
public:
  explicit Model(Entity) {}
  Entity LinkByName(const EntityComponentManager&, const std::string& name) const {
    return name == "block" ? 2 : kNullEntity;
  }
};
} // namespace gz::sim

#define GZ_ADD_PLUGIN(plugin, ...) using StandInPlugin = plugin;
