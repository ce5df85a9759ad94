// Objects and node types that an embedding program offers to a scene, which takes the objects as rapid.host "NAME".
#pragma once

#include <fmt/format.h>

#include <map>
#include <string>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/graph/node_type.h"

namespace rapid {

struct Offers {
    // Change only between frames, on the scene's thread.
    std::map<std::string, ObjectPtr> objects;
    std::map<std::string, ObjectPtr> in_motion;  // replace them in functions of the frame
    std::vector<NodeType> node_types;

    // Returns the object for a function of the frame, which may be the state of a moving one (StateInMotion). Throws
    // Error as object() does.
    const ObjectPtr& object_of_frame(const std::string& name) const
    {
        const auto found = in_motion.find(name);
        return found != in_motion.end() ? found->second : object(name);
    }

    // Returns the object at rest. Throws Error if there is none of this name, and lists the existing names.
    const ObjectPtr& object(const std::string& name) const
    {
        if (const auto found = objects.find(name); found != objects.end()) return found->second;
        std::vector<std::string> names;
        for (const auto& entry : objects) names.push_back(entry.first);
        if (names.empty())
            throw Error(fmt::format("rapid.host \"{}\": the program that opened the scene offers no objects", name));
        const std::string nearest = did_you_mean(name, names);
        throw Error(fmt::format("rapid.host \"{}\": the program offers no such object{}", name,
                                nearest.empty() ? fmt::format("; it offers {}", fmt::join(names, ", ")) : nearest));
    }
};

}  // namespace rapid
