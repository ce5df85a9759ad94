-- rapid explain: the kept and omitted parts of the plan, with reasons, as text and as JSON.
local command = require "testing.command"
local json = require "dkjson"

local folder = command.folder()

local function write(name, body)
  folder:write(name, 'local rapid = require "rapid"\n' .. body)
end

local function explain(arguments)
  return command.rapid("explain " .. arguments, { cwd = folder.path })
end

local function plan_of(arguments)
  local result = explain(arguments .. " --json")
  assert.equal(0, result.status, result.stderr)
  local plan = json.decode(result.stdout)
  local function by_name(list)
    local named = {}
    for _, one in ipairs(list) do named[one.name] = one end
    return named
  end
  return { nodes = by_name(plan.nodes), attributes = by_name(plan.attributes), stages = by_name(plan.stages),
           passes = plan.passes, bytes_per_point = plan.bytes_per_point, raw = plan }
end

local source = "source = rapid.mesh.sphere { radius = 1 }, rate = 100"

write("falls.lua", [[
local beside = rapid.create { name = "spare" }
return rapid.create {} :emit { ]] .. source .. [[, attributes = { heat = 1 } } :gravity {} :solve {}
]])
write("bounces.lua", [[
return rapid.create {} :emit { ]] .. source .. [[, life = 2 }
  :points("swirl", function(p) p.v = p.v + vec3(p.age, 0, 0) end)
  :gravity {} :collide { shape = rapid.shape.plane {} } :solve {} :write { file = "a.####.csv" }
]])

describe("rapid explain --json", function()
  it("lists for each node whether it is kept, how often it is evaluated, and why", function()
    local nodes = plan_of("falls.lua").nodes
    assert.same({ name = "emit1", type = "emit", kept = true, evaluated = "every frame",
                  why = "leads to the output", changes = "its points continue from frame to frame" },
                nodes.emit1)
    assert.same({ name = "spare", type = "create", kept = false, evaluated = "never", why = "leads to no output" },
                nodes.spare)
  end)

  it("names the outputs from which a node is reached where there are several", function()
    write("two.lua", [[
local shared = rapid.create {} :emit { ]] .. source .. [[ } :solve {}
return { left = shared, right = shared:delete { where = function(p) return p.P.x > 0 end } }
]])
    local nodes = plan_of("two.lua").nodes
    assert.equal("leads to the outputs left, right", nodes.solve1.why)
    assert.equal("leads to the output right", nodes.delete1.why)
  end)

  it("evaluates once what never changes", function()
    write("still.lua", [[
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.5 } } :attribute { heat = 1 }
]])
    local nodes = plan_of("still.lua").nodes
    assert.equal("once", nodes.create1.evaluated)
    assert.equal("once", nodes.attribute1.evaluated)
    assert.is_nil(nodes.attribute1.changes)
  end)

  it("leaves an attribute out with the reason, and tells what adds it", function()
    local age = plan_of("falls.lua").attributes.age
    assert.same({ name = "age", simulation = "create2", kept = false, bytes_per_point = 0,
                  why = "no node reads it and no output requests it",
                  brought_in_by = 'p.age in a kernel, rapid.attr "age", or -o FILE:age' }, age)
    assert.is_true(plan_of("falls.lua -o a.####.csv:age").attributes.age.kept)
    assert.truthy(explain("falls.lua").stdout:find(
      'attributes (p.NAME in a kernel, rapid.attr "NAME", or -o FILE:NAME adds one)', 1, true))
  end)

  it("keeps an attribute for who reads it or asks for it", function()
    local falls, bounces = plan_of("falls.lua").attributes, plan_of("bounces.lua").attributes
    assert.equal("every point has it", falls.P.why)
    assert.equal(12, falls.P.bytes_per_point)
    assert.equal("emit1 makes it, and an output takes all attributes of the scene", falls.heat.why)
    assert.equal("swirl, solve1 read it", bounces.age.why)
    assert.equal("solve1 reads it; emit1 writes it", bounces.life.why)
    assert.equal("an output requests it", plan_of("falls.lua -o a.####.csv:mass").attributes.mass.why)
    assert.is_false(plan_of("falls.lua -o a.####.csv:mass").attributes.heat.kept)
  end)

  it("adds up the bytes of a point", function()
    for _, scene in ipairs { "falls.lua", "bounces.lua" } do
      local plan, bytes = plan_of(scene), 0
      for _, attribute in ipairs(plan.raw.attributes) do bytes = bytes + attribute.bytes_per_point end
      assert.equal(bytes, plan.bytes_per_point)
    end
    -- P, v, id, dt, heat
    assert.equal(12 + 12 + 8 + 4 + 4, plan_of("falls.lua").bytes_per_point)
  end)

  it("has all stages, each with who needs it or what is missing", function()
    local falls, bounces = plan_of("falls.lua"), plan_of("bounces.lua -o b.####.csv")
    for name, why in pairs { emission = "emit1", forces = "gravity1", integration = "solve1",
                             ["error estimate"] = "solve1" } do
      assert.same({ name = name, kept = true, why = why }, falls.stages[name])
    end
    for name, why in pairs { collision = "no collide node", ["contact grid"] = "no contact node",
                             constraints = "no constraint node", writing = "no -o and no write node",
                             script = "no node has a Lua function" } do
      assert.same({ name = name, kept = false, why = why }, falls.stages[name])
    end
    assert.equal(9, #falls.raw.stages)
    assert.equal("collide1", bounces.stages.collision.why)
    assert.equal("swirl", bounces.stages.script.why)
    assert.equal("write1, -o b.####.csv", bounces.stages.writing.why)
  end)

  it("lists how often functions of the frame are called, and the values in between", function()
    write("changes.lua", [[
return rapid.create { subframes = 2, points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.5 } }
  :gravity { g = function(frame) return {0, -frame.time, 0} end }
  :contact { radius = 0.1, friction = function(frame) return 0.1 * frame.time end }
  :collide { shape = rapid.shape.plane {}, transform = function(frame) return rapid.translate(0, frame.time, 0) end }
  :pin { group = "held", target = function(frame) return {0, frame.time, 0} end }
  :group { name = "held", where = function(p) return p.id == 0 end } :solve {}
  :attribute { heat = function(frame) return frame.time end }
]])
    local error_has = "the estimated error includes the difference"
    assert.same({
      { name = "gravity1.g", called = "2 times per frame",
        between = "numbers are interpolated to the time of each substep; " .. error_has },
      { name = "contact1.friction", called = "2 times per frame",
        between = "its value at the end is used for the whole frame; " .. error_has },
      { name = "collide1.transform", called = "as often as its path needs",
        between = "called between frames, until pieces of the path are within 1e-5 of its length" },
      { name = "pin1.target", called = "2 times per frame",
        between = "numbers are interpolated to the time of each substep; " .. error_has },
      { name = "attribute1.heat", called = "once per frame", between = "its value is constant in the frame" },
    }, plan_of("changes.lua").raw.functions)
    assert.truthy(explain("changes.lua").stdout:find("functions of the frame\n  gravity1.g ", 1, true))
    assert.same({}, plan_of("falls.lua").raw.functions)
  end)

  it("groups the nodes that go over the points together", function()
    assert.same({ { "emit1" }, { "swirl" }, { "gravity1", "collide1", "solve1" }, { "write1" } },
                plan_of("bounces.lua").passes)
  end)

  it("takes neighbouring edits over the points together, up to a node that is none", function()
    write("edits.lua", [[
return rapid.create {} :emit { ]] .. source .. [[ }
  :points("a", function(p) p.v = p.v * 0.5 end) :group { name = "low", where = function(p) return p.P.y < 0 end }
  :delete { group = "low" } :points("b", function(p) if p.P.x < 0 then p:kill() end end) :attribute { heat = 1 }
  :jitter {} :detail("c", function() end) :points("d", function(p) p.v = p.v * 3 end) :solve {}
  :points("e", function(p) p.v = p.v * 3 end)
]])
    assert.same({ { "emit1" }, { "a", "group1", "delete1", "b", "attribute1", "jitter1" }, { "c" }, { "d" },
                  { "solve1" }, { "e" } }, plan_of("edits.lua").passes)
  end)

  it("ends a pass where a result is asked for by others, and where a place is asked for behind a removal", function()
    write("split.lua", [[
local edited = rapid.create {} :emit { ]] .. source .. [[ } :solve {} :points("a", function(p) p.v = p.v * 2 end)
return { high = edited:delete { where = function(p) return p.P.y < 0 end },
         low = edited:points("b", function(p) if p.P.y > 0 then p:kill() end end)
           :points("c", function(p) p.v = vec3(p.index, 0, 0) end) :points("d", function(p) p.v = p.v * 3 end) }
]])
    assert.same({ { "emit1" }, { "solve1" }, { "a" }, { "delete1" }, { "b" }, { "c", "d" } },
                plan_of("split.lua").passes)
  end)

  it("keeps nothing alive for a node that no output comes from", function()
    write("unread.lua", [[
local points = rapid.create {} :emit { ]] .. source .. [[ } :solve {}
points:points("reader", function(p) p.v = vec3(p.age, 0, 0) end)
return points
]])
    local plan = plan_of("unread.lua")
    assert.is_false(plan.attributes.age.kept)
    assert.is_false(plan.nodes.reader.kept)
  end)
end)

describe("rapid explain", function()
  it("says the same in words, what is kept before what is left out", function()
    for _, scene in ipairs { "falls.lua", "bounces.lua" } do
      local text, plan = explain(scene).stdout, plan_of(scene)
      local left_out = text:find("\nPRUNED\n", 1, true)
      assert.equal(1, (text:find("KEPT\n", 1, true)))
      for _, list in ipairs { plan.raw.nodes, plan.raw.attributes, plan.raw.stages } do
        for _, one in ipairs(list) do
          local at = text:find("\n  " .. one.name:gsub("%p", "%%%0") .. " [^\n]*" .. one.why:gsub("%p", "%%%0"))
          assert.truthy(at, one.name .. ": " .. one.why .. "\n" .. text)
          assert.equal(one.kept, at < left_out, one.name)
        end
      end
      assert.truthy(text:find("\n attributes, at most " .. plan.bytes_per_point .. " bytes per point\n", 1, true), text)
      for _, pass in ipairs(plan.passes) do
        assert.truthy(text:find("\n  " .. table.concat(pass, ", ") .. "\n", 1, true), text)
      end
    end
  end)

  it("neither runs a frame nor writes a file", function()
    local before = folder:list()
    assert.equal(0, explain("bounces.lua -o c.####.csv").status)
    assert.same(before, folder:list())
  end)

  it("refuses what check refuses, in the same words", function()
    write("wrong.lua", 'return rapid.create {} :points("x", function(p) p.haet = 1 end) :solve {}')
    local result = explain "wrong.lua"
    assert.equal(2, result.status)
    assert.equal(command.rapid("check wrong.lua", { cwd = folder.path }).stderr, result.stderr)
    assert.equal(2, explain("falls.lua -o a.####.doc").status)
  end)
end)

describe("rapid explain --against", function()
  it("tells what each of two scenes needs and the other does not", function()
    local result = json.decode(explain("falls.lua --against bounces.lua --json").stdout)
    local function names(list)
      local all = {}
      for i, one in ipairs(list) do all[i] = one.name end
      return all
    end
    assert.same({}, names(result.only_graph.nodes))
    assert.same({ "heat" }, names(result.only_graph.attributes))
    assert.same({}, names(result.only_graph.stages))
    assert.same({ "swirl", "collide1", "write1" }, names(result.only_against.nodes))
    assert.same({ "age", "life" }, names(result.only_against.attributes))
    assert.same({ "script", "collision", "writing" }, names(result.only_against.stages))
    assert.same({ plan_of("falls.lua").bytes_per_point, plan_of("bounces.lua").bytes_per_point },
                result.bytes_per_point)
  end)

  it("says it in words", function()
    local text = explain("falls.lua --against bounces.lua").stdout
    local here = text:find("falls.lua NEEDS, AND bounces.lua DOES NOT\n", 1, true)
    local there = text:find("bounces.lua NEEDS, AND falls.lua DOES NOT\n", 1, true)
    local heat, life = text:find("\n  heat", 1, true), text:find("\n  life", 1, true)
    assert.truthy(here < heat and heat < there and there < life, text)
    assert.truthy(explain("falls.lua --against falls.lua").stdout:find("  nothing\n", 1, true))
  end)

  it("counts turbulence among the forces", function()
    local own = command.folder()
    own:write("scene.lua", [[
local rapid = require "rapid"
return rapid.create { points = rapid.points.grid {} } :turbulence {} :solve {}]])
    local plan = command.rapid("explain scene.lua", { cwd = own.path }).stdout
    assert.truthy(plan:find("\n  forces +turbulence1\n"), plan)
  end)
end)

describe("rapid explain --state", function()
  it("tells what each node keeps after a frame, as a snapshot of that frame does", function()
    local run = command.rapid("run falls.lua -f 1-7 -o state.####.csv --cache state", { cwd = folder.path })
    assert.equal(0, run.status, run.stderr)
    local snapshot = json.decode(command.rapid("info state/snapshot.0007.rapid --json", { cwd = folder.path }).stdout)
    local state = plan_of("falls.lua -o state.####.csv --state 7").raw.state
    assert.equal(7, state.frame)
    assert.same(snapshot.simulations, state.simulations)
    assert.same(snapshot.nodes, state.nodes)
    assert.truthy(state.nodes.emit1 > 0 and state.nodes.solve1 > 0)
    local text = explain("falls.lua -o state.####.csv --state 7").stdout
    assert.truthy(text:find("\nSTATE after frame 7\n", 1, true))
    assert.truthy(text:find(("\n  emit1 +%d B +of the node\n"):format(state.nodes.emit1)), text)
    local wrong = explain "falls.lua --state 0"
    assert.equal(2, wrong.status)
    assert.equal("--state 0 is before the scene's first frame, 1\n", wrong.stderr)
    for _, frame in ipairs { "x", "1-3", "2x2", "1e9", "9223372036854775807", "" } do
      wrong = explain(("falls.lua --state '%s'"):format(frame))
      assert.equal(2, wrong.status)
      local reported = ("--state %s: it must be a frame number, such as 12\n"):format(frame)
      assert.truthy(wrong.stderr:find(reported, 1, true), wrong.stderr)
    end
  end)
end)
