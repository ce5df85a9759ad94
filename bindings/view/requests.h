// Handles the requests of a page. A request is a JSON object: "re", its number; "do", the action; and its arguments.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings/view/film.h"
#include "bindings/view/frame_message.h"
#include "bindings/view/server.h"
#include "bindings/view/simulation.h"
#include "runtime/base/json.h"

namespace rapid {

// Used from one thread, that of the server's handler.
class ViewRequests {
public:
    // post: calls a function on that thread.
    ViewRequests(ViewSimulation& simulation, std::string title, std::function<void(std::function<void()>)> post);

    void handle(const std::string& message, const Answer& answer);
    // Answers the requests that wait for a change of the simulation's status.
    void answer_waiting();

private:
    using Json = CheckedJson;
    struct PendingRequest {  // a request with its number and its answer
        std::uint32_t re;
        Answer answer;

        void reply(Json json) const;
        void send(const std::string& data) const;  // sends a file
        void fail(const std::string& why) const;
        // Calls answer_it(); if it throws, the answer is the error.
        template <class F>
        void guard(const F& answer_it) const;
    };
    // Points that requests name: of an output of a frame, or after a node.
    using WithPoints = std::function<void(const SceneFrame& points)>;

    // Answers a request whose number is known.
    void dispatch(const Json& json, const PendingRequest& request);
    // Calls answer() on the thread of the server's handler, for functions that other threads call.
    template <class F>
    void answer_later(const PendingRequest& request, F answer);
    void with_points(const Json& json, const PendingRequest& request, const WithPoints& use);

    // graph: the number of the page's picture of the graph; a different one is sent.
    void send_status(const PendingRequest& request, std::uint64_t graph) const;
    void send_frame(const Json& json, const PendingRequest& request);
    void send_shapes(const Json& json, const PendingRequest& request);
    void send_point(const Json& json, const PendingRequest& request);
    void send_path(const Json& json, const PendingRequest& request) const;
    void send_trails(const Json& json, const PendingRequest& request);
    void send_trace(const Json& json, const PendingRequest& request);
    void send_sheet(const Json& json, const PendingRequest& request);
    void send_region(const Json& json, const PendingRequest& request);
    void send_figures(const Json& json, const PendingRequest& request) const;
    void send_arguments(const Json& json, const PendingRequest& request);
    void send_picture(const Json& json, const PendingRequest& request);
    void begin_film(const Json& json, const PendingRequest& request);
    void send_film_progress(const PendingRequest& request) const;
    void send_film(const PendingRequest& request);
    void set_parameters(const Json& json, const PendingRequest& request);

    std::uint64_t number_of(const ShapeMesh& mesh);

    ViewSimulation& simulation_;
    const std::string title_;
    const std::function<void(std::function<void()>)> post_;
    struct Waiting {
        std::uint64_t since;  // wants a newer version than this
        std::uint64_t graph;
        PendingRequest request;
    };
    std::vector<Waiting> waiting_;
    std::map<std::weak_ptr<const void>, std::uint64_t, std::owner_less<>> meshes_;  // by owner
    std::uint64_t next_mesh_ = 1;
    std::unique_ptr<ViewFilm> film_;  // at most one
};

}  // namespace rapid
