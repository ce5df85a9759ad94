// Persistent contact pairs: what the two points of each have exerted on each other, kept from sub-step to sub-step for
// warm starting.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/constraints/contact_search.h"
#include "runtime/solver/constraints/sleep.h"
#include "runtime/vec.h"

namespace rapid {

using ContactPair = std::array<std::uint32_t, 2>;  // indices of points

struct PairImpulses {
    std::vector<ContactPair> pairs;
    std::vector<float> normal;      // N s, along the normal, at least 0
    std::vector<Vec3f> tangential;  // N s, by friction, on the first point
    // N s, on the first point: the whole impulse at the end of the last frame in which both were awake. Empty until
    // points may sleep.
    std::vector<Vec3f> resting;
    std::vector<Vec3f> rolling;  // N m s, by rolling friction, on the first point; empty where points do not turn

    // A sub-step of another length begins with the same forces.
    void scale(float factor);

    // Points are at other indices, index[old], or gone: IdIndex::none. Pairs that have lost a point are forgotten; the
    // other is added to `bereft` if it was pressed. The pairs that are kept ascend.
    void renumber(std::span<const std::uint32_t> index, std::vector<std::uint32_t>& bereft);

    // Takes over the impulses of the pairs before a search that are listed still; pairs[slot[k]] is the k-th of the
    // list. Others have been moved apart by a node: sleepers among them wake.
    void take_over(const PairImpulses& before, const Pairs& list, std::span<const std::uint32_t> slot, Sleep* sleep);

    // The pairs beyond the first `listed` become these, which ascend, and those of before that press. False where they
    // are so already.
    bool set_unlisted(std::size_t listed, std::span<const ContactPair> found);
};

}  // namespace rapid
