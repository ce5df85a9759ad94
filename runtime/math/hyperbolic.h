// Hyperbolic functions, bit-identical on every processor, with the special cases of C.
//
// The error is below 0.7 units in the last place (tests/lanes/test_elementary_functions.cpp).
#pragma once

namespace rapid {

double hyperbolic_sine(double x);
double hyperbolic_cosine(double x);
double hyperbolic_tangent(double x);

// Inverse tangent, sine and cosine, bit-identical on every processor, with the special cases of C.
//
// The error is below 0.8 units in the last place (tests/lanes/test_elementary_functions.cpp).
double arc_tangent(double x);
double arc_tangent(double y, double x);  // angle of the point (x, y): C's atan2
double arc_sine(double x);
double arc_cosine(double x);

}  // namespace rapid
