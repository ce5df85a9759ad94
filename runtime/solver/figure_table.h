// The table of the statistics of a frame, which declares each of them.
//
//   F(type, name, together, later, reported, unit, meaning, chart, warning)
//
//   type, name   the member of FrameFigures (figures.h); the name is the key in the file of --stats, in this order
//   together     merges parts of the points that are advanced side by side: chunks, constraints, simulations
//   later        merges the next subframe into the frame so far
//   reported     the condition under which the statistics of `frame` have the key
//   unit         of the value; empty: a count, or several values
//   meaning      as in docs/cli.md
//   chart        the title of the chart in the viewer; empty: no chart
//   warning      the sentence of a run's summary if the count is not always 0, with {} for how often; empty: none
//
// The code that measures a figure adds it to the FrameFigures that it receives or returns.
#pragma once

// clang-format off
#define RAPID_FIGURES(F)                                                                                               \
    F(std::int64_t, frame, last, last, true, "",                                                                       \
      "its number", "", "")                                                                                            \
    F(std::uint64_t, points, last, last, true, "",                                                                     \
      "points of all outputs", "points", "")                                                                           \
    F(std::uint64_t, born, sum, sum, true, "",                                                                         \
      "points born in the frame", "", "")                                                                              \
    F(std::uint64_t, died, sum, sum, true, "",                                                                         \
      "points that died in the frame", "", "")                                                                         \
    F(int, substeps, most, most, true, "",                                                                             \
      "the largest number of substeps of a point", "substeps", "")                                                     \
    F(StageSeconds, seconds, sum, sum, true, "s",                                                                      \
      "`total`, `graph`, `script`, `solve`, `write`", "time of a frame", "")                                           \
    F(Sampled<ErrorQuantiles>, error, sum, last, frame.error.summary.has_value(), "m",                                 \
      "`position_p50`, `position_p95`, `position_max`: the estimated error of positions, accumulated since birth; "    \
      "absent if not estimated", "estimated error, 95 %", "")                                                          \
    F(Sampled<ErrorQuantiles>, frame_error, sum, last, frame.frame_error.summary.has_value(), "m",                     \
      "the same for the error made in this frame, if too many points are coupled", "", "")                             \
    F(std::vector<std::string>, left_out_of_errors, sum, last, !frame.left_out_of_errors.empty(), "",                  \
      "strings: parts that neither estimate includes; absent if there are none", "", "")                               \
    F(double, rounding, most, last, true, "m",                                                                         \
      "the largest displacement of a point by rounding to single precision since birth", "", "")                       \
    F(Sampled<DriftSummary>, energy_drift, sum, last, true, "J/kg",                                                    \
      "`mean`, `max`: since birth, by the integrator alone; null if the forces have no potential",                     \
      "energy drift, largest", "")                                                                                     \
    F(double, penetration_max, most, last, true, "m",                                                                  \
      "the deepest point in a shape at the end of the frame", "deepest penetration", "")                               \
    F(double, constraint_residual_max, most, last, true, "m",                                                          \
      "of all constraints at the end of the frame", "", "")                                                            \
    F(std::uint64_t, constraint_rows, sum, last, frame.constraint_rows > 0, "",                                        \
      "active rows at the end of the frame; absent if there are none", "", "")                                         \
    F(std::uint64_t, loose_constraints, sum, last, frame.constraint_rows > 0, "",                                      \
      "rows with an error of more than a tenth of their size", "",                                                     \
      "constraints had an error of more than a tenth of their size {}: separate points that overlap at birth, "        \
      "or give :solve more substeps")                                                                                  \
    F(std::uint64_t, broken, sum, sum, frame.broken > 0, "",                                                           \
      "pairs of `:distance` that broke in the frame; absent if none did", "", "")                                      \
    F(std::uint64_t, asleep, sum, last, true, "",                                                                      \
      "points that sleep at the end of the frame", "asleep", "")                                                       \
    F(std::optional<ContactGrids>, contact_grids, latest, last, frame.contact_grids.has_value(), "",                   \
      "of the contact search: `points` (points of each grid), `error`, `excess` (cells larger than needed), "          \
      "`search_seconds`", "", "")                                                                                      \
    F(std::uint64_t, collisions, sum, sum, true, "",                                                                   \
      "contacts with shapes", "contacts", "")                                                                          \
    F(ContactEnergy, contact_energy, sum, sum, true, "J",                                                              \
      "`added`, `lost`: by contacts with shapes and between points", "", "")                                           \
    F(std::optional<Ledger>, ledger, sum, sum, frame.ledger.has_value(), "J",                                          \
      "energy of constrained points and the causes of its change, and their momentum (below)",                         \
      "energy of constrained points", "")                                                                              \
    F(std::vector<BandFigures>, bands, sum, by_node, !frame.bands.empty(), "",                                         \
      "of each collider with a level set: `node`, `width` (m), `voxels`, `seconds`", "", "")                           \
    F(std::uint64_t, contact_limit, sum, sum, true, "",                                                                \
      "points that reached the limit of contacts in a step", "",                                                       \
      "points reached the limit of contacts in a step {}: give :solve more substeps")                                  \
    F(std::uint64_t, trapped, sum, most, true, "",                                                                     \
      "points deep in a shape that could not be moved out", "",                                                        \
      "points could not be moved out of a shape {}: emit them outside, or move the shapes apart")                      \
    F(std::uint64_t, beyond_tolerance, sum, most, true, "",                                                            \
      "points that would need more than `max_substeps`, or whose position a sample with other substeps does not "      \
      "confirm", "", "points were beyond the tolerance {}: raise it, or max_substeps")                                 \
    F(std::vector<NodeWork>, nodes, last, last, true, "",                                                              \
      "cost of each pass over the points, in order (below)", "", "")                                                   \
    F(std::vector<Stiffness>, stiff, sum, sum, false, "",                                                              \
      "of the whole run: stiff forces and actions, as strings; absent if there are none", "", "")
// clang-format on
