// Spheres that fall on rough rock, bounce, slide and roll: contacts that form and end, each with its own
// state. The tables are compiled in, so the program needs no file.
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>
#include "granite.h"

struct Sphere {
  double x, z, vx, vz, spin; // position and velocity along and above the rock, spin (about the third axis)
};

int main()
{
  const jlaw_law *law = &granite;
  const double radius = 0.05, density = 2600.0, gravity = 9.81, pi = std::acos(-1.0);
  const double mass = density * 4.0 / 3.0 * pi * radius * radius * radius;
  const double inertia = 0.4 * mass * radius * radius;
  const double area = 1e-4; // m2, of the joint of a contact: forces are area times F
  // the largest closure after a fall of 2 mm bounds the stiffness and thus the time step
  double deepest = law->max_effective_closure;
  for (double y = 1e-9; y < deepest; y *= 1.1)
    if (0.5 * area * jlaw_normal_stress(law, y) * y > 10.0 * mass * gravity * 2e-3) deepest = y;
  const double dt = 0.1 * 2.0 * std::sqrt(mass / (area * jlaw_max_stiffness(law, deepest)));

  std::vector<Sphere> spheres;
  for (int i = 0; i < 5; i++)
    spheres.push_back({0.2 * i, radius + 1e-3 + 2e-4 * i, 0.02 * (i + 1), 0.0, 0.0});
  std::map<std::size_t, std::vector<double>> contacts; // state of the contact of each sphere with the rock
  int formed = 0, ended = 0;
  double dissipated = 0.0; // J, in ended contacts
  char message[JLAW_MESSAGE];

  const long steps = static_cast<long>(0.05 / dt);
  for (long step = 0; step < steps; step++) {
    for (std::size_t i = 0; i < spheres.size(); i++) {
      Sphere &s = spheres[i];
      double force_x = 0.0, force_z = -mass * gravity, torque = 0.0;
      const double closure = radius - s.z; // from positions; a sum of increments would drift
      auto contact = contacts.find(i);
      if (contact == contacts.end() && closure > 0.0) { // first touch: a virgin joint
        contact = contacts.emplace(i, std::vector<double>(jlaw_state_size(law), 0.0)).first;
        formed++;
      }
      if (contact != contacts.end()) {
        std::vector<double> &state = contact->second;
        // motion of the surface of the sphere relative to the rock: closure, shear along x
        double d[3] = {closure - state[0], (s.vx + s.spin * radius) * dt, 0.0}, F[3] = {0.0, 0.0, 0.0};
        if (jlaw_update(law, state.data(), state.data(), d, F, nullptr, message, sizeof message)) {
          std::fprintf(stderr, "sphere %zu: %s\n", i, message);
          return 1;
        }
        force_z += area * F[0]; // axis 1 points into the rock
        if (jlaw_dim(law) > 1) {
          force_x -= area * F[1];
          torque -= area * F[1] * radius;
        }
        if (closure < -1e-5) { // separated: the next contact is between other asperities
          dissipated += area * jlaw_dissipated_energy(law, state.data());
          contacts.erase(contact);
          ended++;
        }
      }
      s.vx += force_x / mass * dt; // symplectic Euler: velocities from the forces, then positions
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
  for (auto &entry : contacts) dissipated += area * jlaw_dissipated_energy(law, entry.second.data());
  std::printf("contacts formed %d, ended %d, energy dissipated %.3e J\n", formed, ended, dissipated);
}
