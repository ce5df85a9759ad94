#include "tests/operators/node_test.h"

namespace rapid {

// Fields of nodes have no initialisers: the default is only in the declaration.
TEST_CASE("every parameter of a node has a default, is required, or has a field that can be empty", "[registry]")
{
    const Registry registry;
    for (const NodeType* type : registry.types()) {
        const std::unique_ptr<Operator> op = type->make();
        for (const Param& param : type->params) {
            if (param.required) continue;
            CAPTURE(type->name, param.name);
            CHECK_NOTHROW(param.assign(param, op->fields(), param.fallback));
        }
    }
}

}  // namespace rapid
