// Hyperbolic functions, bit-identical on every processor, with the special cases of C.
//
// The error is below 0.7 units in the last place (tests/lanes/test_elementary_functions.cpp).
#pragma once

namespace rapid {

double hyperbolic_sine(double x);
double hyperbolic_cosine(double x);
double hyperbolic_tangent(double x);

}  // namespace rapid
