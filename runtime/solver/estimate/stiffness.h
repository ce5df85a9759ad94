// Which forces and actions are stiff: change a point within a sub-step about as much as it is there at all.
//
// Found from a sample of the points where they are. Linear drags and springs say their rates themselves, and are solved
// exactly at any step. Of all else the derivatives of the acceleration by place and velocity are taken by differences:
// x'' = J x + K x' turns and decays by the eigenvalues of both together. What it costs is solved, not guessed: the
// sample's frame with the sub-steps that there are, with so many that the motion is followed, and with many more.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/solver/dynamics.h"

namespace rapid {

struct SolveOptions;

struct Stiffness {
    enum Kind {
        Drag,         // k dt, of a drag that is solved exactly
        Spring,       // omega dt, of a spring that is
        SquaredDrag,  // c v dt
        Decay,        // k dt, of a drag that is not
        Turning,      // omega dt
    };

    std::string node;  // drag1; action "sun"
    Kind kind = Drag;
    double step = 0;         // of the stiffest point: the number that `kind` names
    int substeps = 1;        // that it is at
    std::int64_t frame = 0;  // that it was found in

    // The largest errors of the sample's positions after this frame, m, as it is and with more sub-steps. Nothing of
    // what is exact, nor where points are coupled: a sample alone goes elsewhere.
    struct Cure {
        double error;
        int substeps;
        double error_then;
    };
    std::optional<Cure> cure;

    bool is_exact() const { return kind == Drag || kind == Spring; }
};

// Of the points as they are before Solve, in the order of the chain; what is not stiff is left out. Changes nothing.
std::vector<Stiffness> find_stiff(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options);

// Of all that was found of a node the worst.
void keep_worst(std::vector<Stiffness>& worst, const std::vector<Stiffness>& found);

// drag1: k dt = 16; treated exactly
// action "sun": omega dt = 1.9 at 1 sub-step; estimated error 0.2 m; 8 sub-steps would give 0.003 m
std::string text_of(const Stiffness& stiffness);

}  // namespace rapid
