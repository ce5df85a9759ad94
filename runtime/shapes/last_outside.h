// The root search at the end of every walk: between a time at which a path is outside a shape and one at which it is
// not.
#pragma once

namespace rapid {

// The last time found at which the path is outside: height(before) = f_before >= 0, height(after) = f_after < 0. Down
// to `close` (m) of height, or of the way at this speed (m/s), or to the rounding of the time. By regula falsi with
// Illinois' halving.
template <class Height>
double last_outside(const Height& height, double before, double f_before, double after, double f_after, double speed,
                    double close)
{
    double ahead = f_before;   // as found: f_before and f_after are halved on the way
    int kept = 0;              // how often in a row the same end was kept: +1, +2, ... before, -1, -2, ... after
    constexpr int most = 200;  // far above what bisection alone needs for 53 bits
    for (int i = 0; i < most && ahead > close; ++i) {
        if (after - before <= 0x1p-52 * after || speed * (after - before) <= close) break;
        // Every fourth step is bisection: a field with a kink can hold regula falsi up, and nothing holds that up.
        double s = i % 4 == 3 ? 0.5 * (before + after) : before + (after - before) * f_before / (f_before - f_after);
        if (!(s > before && s < after)) s = 0.5 * (before + after);
        if (!(s > before && s < after)) break;
        const double f = height(s);
        if (f >= 0) {
            before = s, f_before = ahead = f;
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
