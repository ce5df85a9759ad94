// Objects that only graph code uses: the name of an attribute.
#pragma once

#include <string>

#include "runtime/graph/node_type.h"

namespace rapid {

// `rapid.attr "bounce"`.
class AttributeName : public Object {
public:
    explicit AttributeName(std::string attribute) : name(std::move(attribute)) {}
    std::string_view kind() const override { return "attribute"; }

    const std::string name;
};

}  // namespace rapid
