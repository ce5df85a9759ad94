// The root search at the end of every walk to a contact, between a time when the path is outside the shape and one when
// it is inside.
#pragma once

namespace rapid {

struct Bracket {
    double before, height_before;  // s along the path; height >= 0
    double after, height_after;    // height < 0
};

// Returns the time of the crossing in a bracket, on its outer side (height >= 0). The bracket is narrowed until the
// height is at most `close` (m), the path within it is at most `close` long at this speed (m/s), or the rounding of the
// time is reached. The method is regula falsi with the Illinois rule, plus bisection.
template <class Height>
double crossing_time(const Height& height, const Bracket& bracket, double speed, double close)
{
    double before = bracket.before, f_before = bracket.height_before;
    double after = bracket.after, f_after = bracket.height_after;
    double outer = f_before;   // as sampled; the Illinois rule halves f_before and f_after
    int kept = 0;              // consecutive steps that kept the same end: +1, +2, ... before, -1, -2, ... after
    constexpr int most = 200;  // far more than bisection alone needs for 53 bits
    for (int i = 0; i < most && outer > close; ++i) {
        if (after - before <= 0x1p-52 * after || speed * (after - before) <= close) break;
        // Every fourth step is a bisection, which converges even if a kink of the field stalls regula falsi.
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
