// Gazebo system plugin of a model: the water acts on its link "block", and the stochastic force.
//
// The forces are those of floating_block.c, added before every step of the physics.
#include "floating_block.h"

#include <gz/math/Pose3.hh>
#include <gz/math/Vector3.hh>
#include <gz/plugin/Register.hh>
#include <gz/sim/EntityComponentManager.hh>
#include <gz/sim/Link.hh>
#include <gz/sim/Model.hh>
#include <gz/sim/System.hh>

#include <chrono>
#include <cstdint>
#include <iostream>
#include <memory>

namespace driftwalk {

class Water : public gz::sim::System,
              public gz::sim::ISystemConfigure,
              public gz::sim::ISystemPreUpdate {
public:
  void Configure(const gz::sim::Entity& entity, const std::shared_ptr<const sdf::Element>& element,
                 gz::sim::EntityComponentManager& components, gz::sim::EventManager&) override {
    link_ = gz::sim::Link(gz::sim::Model(entity).LinkByName(components, "block"));
    if (!link_.Valid(components)) {
      std::cerr << "driftwalk::Water: the model has no link named block" << std::endl;
      return;
    }
    link_.EnableVelocityChecks(components, true);
    // Another number: another run with the same seed.
    replicate_ = element->Get<std::uint64_t>("replicate", 0).first;
    fb_begin_drive(&drive_, floating_block_model.seed, replicate_);
  }

  void PreUpdate(const gz::sim::UpdateInfo& info,
                 gz::sim::EntityComponentManager& components) override {
    const auto pose = link_.WorldPose(components);
    if (info.paused || info.dt.count() <= 0 || !pose) {
      return;
    }
    const auto velocity = link_.WorldLinearVelocity(components).value_or(gz::math::Vector3d::Zero);
    const auto spin = link_.WorldAngularVelocity(components).value_or(gz::math::Vector3d::Zero);
    const fb_state state{pose->Pos().X(), pose->Pos().Y(), pose->Rot().Yaw(),
                         velocity.X(),    velocity.Y(),    spin.Z()};
    // The time is that of the end of the step.
    const double begin = std::chrono::duration<double>(info.simTime - info.dt).count();
    const double step = std::chrono::duration<double>(info.dt).count();
    if (begin < last_) { // the simulation was reset
      fb_begin_drive(&drive_, floating_block_model.seed, replicate_);
    }
    last_ = begin;
    const fb_push push = fb_drive_step(&floating_block_model, &drive_, &state, begin, step);
    link_.AddWorldWrench(components, {push.x, push.y, 0}, {0, 0, push.torque});
  }

private:
  gz::sim::Link link_{gz::sim::kNullEntity};
  std::uint64_t replicate_ = 0;
  fb_drive drive_{};
  double last_ = 0; // begin of the last step [s]
};

} // namespace driftwalk

GZ_ADD_PLUGIN(driftwalk::Water, gz::sim::System, driftwalk::Water::ISystemConfigure,
              driftwalk::Water::ISystemPreUpdate)
