// The root search that ends every walk to a contact: between a time at which the path is outside the shape and one at
// which it is inside.
#pragma once

namespace rapid {

struct Bracket {
    double before, height_before;  // s along the path; height >= 0
    double after, height_after;    // height < 0
};

// The time of the crossing in a bracket, on its outer side: height(s) >= 0 there, and the bracket around it is narrowed
// down to `close` (m) of height, or of the path at this speed (m/s), or to the rounding of the time. Regula falsi with
// the Illinois rule, and bisection.
template <class Height>
double crossing_time(const Height& height, const Bracket& bracket, double speed, double close)
{
    double before = bracket.before, f_before = bracket.height_before;
    double after = bracket.after, f_after = bracket.height_after;
    double outer = f_before;   // as sampled: the Illinois rule halves f_before and f_after
    int kept = 0;              // how often in a row the same end was kept: +1, +2, ... before, -1, -2, ... after
    constexpr int most = 200;  // far above what bisection alone needs for 53 bits
    for (int i = 0; i < most && outer > close; ++i) {
        if (after - before <= 0x1p-52 * after || speed * (after - before) <= close) break;
        // Every fourth step is a bisection, which converges where a kink of the field stalls regula falsi.
        double s = i % 4 == 3 ? 0.5 * (before + after) : before + (after - before) * f_before / (f_before - f_after);
        if (!(s > before && s < after)) s = 0.5 * (before + after);
        if (!(s > before && s < after)) break;
        const double f = height(s);
        if (f >= 0) {
            before = s, f_before = outer = f;
            kept = kept < 0 ? kept - 1 : -1;
            if (kept < -1) f_after *= 0.5;
        } else {
            after = s, f_after = f;
            kept = kept > 0 ? kept + 1 : 1;
            if (kept > 1) f_before *= 0.5;
        }
    }
    return before;
}

}  // namespace rapid
