#include "runtime/report/frame_profile.h"

#include "runtime/json_text.h"

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
    for (const NodeWork& work : result.work) {
        json.begin_object();
        json.member("nodes", work.nodes);
        json.member("stage", std::string(name_of(work.stage)));
        json.member("begin", work.begin);
        json.member("seconds", work.seconds);
        json.member("points", work.points);
        json.member("bytes", work.bytes);
        json.end();
    }
    json.end();
    return json.text();
}

}  // namespace rapid
