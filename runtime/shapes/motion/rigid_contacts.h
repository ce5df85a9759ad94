// Finds the first contacts of paths with a moving shape, within one piece of its motion.
#pragma once

#include <span>
#include <vector>

#include "runtime/shapes/motion/rigid_field.h"

namespace rapid {

class RigidContacts {
public:
    // Both must outlive this.
    RigidContacts(const RestShape& rest, const MotionTrack::Piece& piece, std::span<const Path> paths,
                  std::span<Contact> contacts)
        : rest_(rest), piece_(piece), paths_(paths), contacts_(contacts)
    {
    }

    // Adds path i between two of its times.
    void add(std::size_t i, double from, double to)
    {
        beginnings_.push_back({i, RelativePath(piece_, paths_[i], from, to), from, to});
    }

    // Writes the contacts of the paths that have one.
    void find();

private:
    struct Beginning {
        std::size_t path;
        RelativePath relative;
        double from, to;
    };
    struct Walker {
        std::size_t path;
        double end;
        ContactWalk<RigidField> walk;
    };

    void begin(const Beginning& beginning, const RelativePath::State& here, double phi, const Vec3d& gradient);
    Contact inside(const Beginning& beginning, const RelativePath::State& here) const;
    void fly_straight();
    void walk();

    const RestShape& rest_;
    const MotionTrack::Piece& piece_;
    std::span<const Path> paths_;
    std::span<Contact> contacts_;
    std::vector<Beginning> beginnings_;
    std::vector<Walker> walkers_;
};

}  // namespace rapid
