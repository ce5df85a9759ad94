#include "runtime/report/frame_profile.h"

#include "runtime/base/json.h"

namespace rapid {

const char* name_of(NodeWork::Stage stage)
{
    switch (stage) {
        case NodeWork::Stage::Graph:
            return "graph";
        case NodeWork::Stage::Script:
            return "script";
        case NodeWork::Stage::Solve:
            return "solve";
    }
    return "";
}

std::string profile_json(const FrameResult& result)
{
    JsonText json;
    json.begin_list();
    for (const NodeWork& work : result.work)
        json.object("nodes", work.nodes, "stage", name_of(work.stage), "begin", work.begin, "seconds", work.seconds,
                    "points", work.points, "bytes", work.bytes);
    json.end();
    return json.text();
}

}  // namespace rapid
