// Spheres that fall on rough rock, bounce, slide and roll: contacts that come and go, each with its
// own state. The tables are compiled in, so the program needs no file.
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>
#include "granite.h"

struct Sphere {
  double x, z, vx, vz, spin; // place and speed along and above the rock, spin (about the third axis)
};

int main()
{
  const jlaw_law *law = &granite;
  const double radius = 0.05, density = 2600.0, gravity = 9.81, pi = std::acos(-1.0);
  const double mass = density * 4.0 / 3.0 * pi * radius * radius * radius;
  const double inertia = 0.4 * mass * radius * radius;
  const double area = 1e-4; // m2 of joint that a contact stands for: its forces are area times F
  // the closure that a fall of 2 mm can reach bounds the stiffness, and so the time step
  double deepest = law->max_effective_closure;
  for (double y = 1e-9; y < deepest; y *= 1.1)
    if (0.5 * area * jlaw_normal_stress(law, y) * y > 10.0 * mass * gravity * 2e-3) deepest = y;
  const double dt = 0.1 * 2.0 * std::sqrt(mass / (area * jlaw_max_stiffness(law, deepest)));

  std::vector<Sphere> spheres;
  for (int i = 0; i < 5; i++)
    spheres.push_back({0.2 * i, radius + 1e-3 + 2e-4 * i, 0.02 * (i + 1), 0.0, 0.0});
  std::map<std::size_t, std::vector<double>> contacts; // of a sphere with the rock: its state
  int begun = 0, ended = 0;
  double lost = 0.0; // by contacts that have ended
  char message[JLAW_MESSAGE];

  const long steps = static_cast<long>(0.05 / dt);
  for (long step = 0; step < steps; step++) {
    for (std::size_t i = 0; i < spheres.size(); i++) {
      Sphere &s = spheres[i];
      double force_x = 0.0, force_z = -mass * gravity, torque = 0.0;
      const double closure = radius - s.z; // from places, never summed up
      auto found = contacts.find(i);
      if (found == contacts.end() && closure > 0.0) { // touches: virgin
        found = contacts.emplace(i, std::vector<double>(jlaw_state_size(law), 0.0)).first;
        begun++;
      }
      if (found != contacts.end()) {
        std::vector<double> &state = found->second;
        // the sphere's surface moves by this against the rock: closure, shear along x
        double d[3] = {closure - state[0], (s.vx + s.spin * radius) * dt, 0.0}, F[3] = {0.0, 0.0, 0.0};
        if (jlaw_update(law, state.data(), state.data(), d, F, nullptr, message, sizeof message)) {
          std::fprintf(stderr, "sphere %zu: %s\n", i, message);
          return 1;
        }
        force_z += area * F[0]; // axis 1 points into the rock, the rock pushes back
        if (jlaw_dim(law) > 1) {
          force_x -= area * F[1];
          torque -= area * F[1] * radius;
        }
        if (closure < -1e-5) { // far apart: its asperities are met by others next time
          lost += area * jlaw_dissipated_energy(law, state.data());
          contacts.erase(found);
          ended++;
        }
      }
      s.vx += force_x / mass * dt; // forces act between the places of now and the next speeds
      s.vz += force_z / mass * dt;
      s.spin += torque / inertia * dt;
      s.x += s.vx * dt;
      s.z += s.vz * dt;
    }
  }
  std::printf("sphere,x_m,height_um,speed_m_s,spin_rad_s\n");
  for (std::size_t i = 0; i < spheres.size(); i++)
    std::printf("%zu,%.6f,%.3f,%.6f,%.6f\n", i, spheres[i].x, 1e6 * (spheres[i].z - radius),
                spheres[i].vx, spheres[i].spin);
  for (auto &contact : contacts) lost += area * jlaw_dissipated_energy(law, contact.second.data());
  std::printf("contacts begun %d, ended %d, energy lost to friction %.3e J\n", begun, ended, lost);
}
