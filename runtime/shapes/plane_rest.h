// Whether a point that touches a plane and moves off it stays on it.
#pragma once

namespace rapid {

// vn: its speed out of the plane, m/s; g: m/s², into it. It stays where it would rise by less than rounding (`flush`,
// m), and be back within the time T. If it would still be off the plane then it leaves: what lifts it may act again
// before it has fallen back.
inline bool stays_on_plane(double vn, double g, double flush, double T)
{
    return g > 0 && vn * vn <= 2 * g * flush && 2 * vn <= g * T;
}

}  // namespace rapid
