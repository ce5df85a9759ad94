// Decides whether a point that touches a plane and moves off it stays on it.
#pragma once

namespace rapid {

// Returns true if a point with speed vn out of the plane, m/s, and acceleration g into it, m/s², rises by less than
// rounding (`flush`, m) and is back within the time T. A point that is still off the plane after T leaves it, because
// the cause of its rise may act again before it has fallen back.
inline bool stays_on_plane(double vn, double g, double flush, double T)
{
    return g > 0 && vn * vn <= 2 * g * flush && 2 * vn <= g * T;
}

}  // namespace rapid
