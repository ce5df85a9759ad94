-- rapid study: error against run time, of study files and of graphs by --sweep.
local command = require "testing.command"
local json = require "dkjson"

local folder = command.folder()

-- Points at rest, pushed by an action at the midpoint of each substep: v grows by dt^power each time, so after t
-- seconds the position error is dt^(power - 1) t²/2.
local header = 'local rapid = require "rapid"\n'
local function study(name, fields)
  folder:write(name, header .. [[
local function scene(k)
  return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}} } }
    :action("late", function(p, step) p.v = p.v + vec3(0, step.dt ^ k.power, 0) end)
    :solve { substeps = k.substeps }
end
local function still() return { P = {{0, 0, 0}, {1, 0, 0}} } end
return rapid.study { name = "late", scene = scene, frames = {1, 25}, repeat_runs = 2,
  sweep = { power = {2, 3}, substeps = {1, 2, 4} }, lines = "power", reference = still,
]] .. (fields or "") .. "}\n")
end

local function rapid(arguments)
  return command.rapid("study " .. arguments, { cwd = folder.path })
end

local function result_of(arguments)
  local result = rapid(arguments .. " --json -o out")
  assert.equal("", (result.stderr:gsub("%d+/%d+  [^\n]*\n", "")))
  return json.decode(result.stdout), result
end

local function row_of(found, knobs)
  for _, row in ipairs(found.rows) do
    local same = true
    for knob, value in pairs(knobs) do same = same and row.knobs[knob] == value end
    if same then return row end
  end
end

local function off(frames, substeps, power)
  return (1 / (24 * substeps)) ^ (power - 1) * (frames / 24) ^ 2 / 2
end

describe("rapid study", function()
  it("gives the error that the closed form says, and the order of each line", function()
    study "late.lua"
    local found, result = result_of "late.lua"
    assert.equal(0, result.status)
    assert.equal(6, #found.rows)
    for _, row in ipairs(found.rows) do
      local sum = 0
      for n = 1, 24 do sum = sum + off(n, row.knobs.substeps, row.knobs.power) ^ 2 end
      assert.near(math.sqrt(sum / 24), row.error, 2e-6)
      assert.equal(2 * 24, row.compared)
      assert.equal(0, row.missing)
      assert.is_true(row.seconds_min <= row.seconds and row.seconds <= row.seconds_max and row.seconds_min > 0)
    end
    assert.near(1, found.lines[1].order, 0.01)
    assert.near(2, found.lines[2].order, 0.05)
  end)

  it("writes what it prints as study.json, with the machine, beside a picture of every line", function()
    study "late.lua"
    local result = rapid "late.lua --json --repeat 1 -o written"
    local found = json.decode(result.stdout)
    assert.equal(result.stdout, folder:read "written/study.json")
    for _, what in ipairs { "processor", "threads", "system", "rapid", "compiler" } do
      assert.truthy(#found.machine[what] > 0, what)
    end
    assert.equal(1, found.repeat_runs)
    local svg = folder:read "written/study.svg"
    local lines, markers = select(2, svg:gsub('<path class="line"', "")), select(2, svg:gsub("<title>error", ""))
    assert.equal(2 * 2, lines) -- one each in the plot and in the legend
    assert.equal(6, markers)
    assert.truthy(svg:find("prefers-color-scheme: dark", 1, true))
    assert.truthy(svg:find("order 1.00", 1, true))
  end)

  it("prints a table with the orders, and a * where no other row is better", function()
    study "late.lua"
    local result = rapid "late.lua --quiet -o out"
    assert.equal(0, result.status, result.stderr)
    assert.equal("", result.stderr)
    local head = "late: rms error of P (m), frames 2 to 25, against the closed form; median of 2 runs\n"
    assert.equal(head, result.stdout:sub(1, #head))
    assert.truthy(result.stdout:find "\npower 2: order 1.00, fitted to 3 rows\n", result.stdout)
    assert.truthy(result.stdout:find "\n%* +3 +4 ", result.stdout) -- the smallest error is always among them
  end)

  it("uses the requested norm: max, p95, the last frame, or the study's own", function()
    study("late.lua", 'error = "max"')
    assert.near(off(24, 2, 2), row_of(result_of "late.lua", { power = 2, substeps = 2 }).error, 2e-6)
    study("late.lua", 'error = "p95"')
    assert.near(off(23, 2, 2), row_of(result_of "late.lua", { power = 2, substeps = 2 }).error, 2e-6)
    study("late.lua", 'error_frames = "last"')
    assert.near(off(24, 2, 2), row_of(result_of "late.lua", { power = 2, substeps = 2 }).error, 2e-6)
    study("late.lua", [[error = function(points, reference)
      return #points.P + 10 * (points.P[2].x - reference.P[1].x) + points.id[2] end]])
    assert.equal(2 + 10 + 1, row_of(result_of "late.lua", { power = 2, substeps = 2 }).error)
  end)

  it("takes other knobs for the reference: each line's own, or one for all", function()
    study("late.lua", "reference = { substeps = 8 }")
    for _, power in ipairs { 2, 3 } do
      local row = row_of(result_of "late.lua --repeat 1", { power = power, substeps = 1 })
      local sum = 0
      for n = 1, 24 do sum = sum + (off(n, 1, power) - off(n, 8, power)) ^ 2 end
      assert.near(math.sqrt(sum / 24), row.error, 2e-6)
    end
    study("late.lua", "reference = { substeps = 4, power = 3 }")
    assert.equal(0, row_of(result_of "late.lua --repeat 1", { power = 3, substeps = 4 }).error)
    assert.is_true(row_of(result_of "late.lua --repeat 1", { power = 2, substeps = 4 }).error > 1e-3)
  end)

  it("reports rows that rounding alone decides as exact, with the fastest of them as best", function()
    folder:write("fall.lua", header .. [[
return rapid.study { name = "fall", frames = {1, 25}, sweep = { substeps = {1, 64} },
  scene = function(k)
    return rapid.create { points = rapid.points.grid { spacing = 0.1 } } :gravity {} :attribute { heavy = 1 }
      :drag { linear = rapid.attr "heavy" } :solve { substeps = k.substeps }
  end,
  reference = { substeps = 3 } }]])
    local found = result_of "fall.lua"
    assert.is_true(found.lines[1].at_rounding)
    assert.is_nil(found.lines[1].order)
    assert.is_true(found.rows[1].best)
    assert.is_false(found.rows[2].best)
  end)

  it("matches points by id, and counts those that one side lacks", function()
    folder:write("gone.lua", header .. [[
return rapid.study { name = "gone", frames = {1, 3}, repeat_runs = 1, sweep = { substeps = {1, 2} },
  scene = function(k)
    return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}} } }
      :delete { where = function(p) return p.id == 0 end } :solve { substeps = k.substeps }
  end,
  reference = function() return { P = {{9, 0, 0}, {1, 0, 0}, {2.5, 0, 0}} } end, error = "max" }]])
    local row = result_of("gone.lua").rows[1]
    assert.near(0.5, row.error, 1e-6)
    assert.equal(2 * 2, row.compared)
    assert.equal(2 * 1, row.missing)
  end)

  it("shows a run that fails or crashes as failed, runs the others, and exits 1", function()
    folder:write("bad.lua", header .. [[
return rapid.study { name = "bad", frames = {1, 3}, repeat_runs = 1, sweep = { how = {"well", "wrongly", "far"} },
  scene = function(k)
    return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }
      :points("break", function(p)
        if k.how == "wrongly" then error "no way" end
        if k.how == "far" then p.P = vec3(3e38, 3e38, 0) end
      end) :solve {}
  end,
  reference = function() return { P = {{0, 0, 0}} } end }]])
    local result = rapid "bad.lua --json -o out"
    assert.equal(1, result.status)
    local found = json.decode(result.stdout)
    assert.is_nil(found.rows[1].failed)
    assert.equal(0, found.rows[1].error)
    assert.truthy(found.rows[2].failed:find("no way", 1, true), found.rows[2].failed)
    assert.truthy(found.rows[2].failed:find("bad.lua:6: node \"break\"", 1, true), found.rows[2].failed)
    assert.is_false(found.rows[2].best)
    assert.truthy(result.stderr:find("2/3  how wrongly: failed: ", 1, true), result.stderr)
    assert.truthy(folder:read("out/study.svg"):find("1 failed", 1, true))
  end)

  it("ends a scene that never ends, as one failure of many", function()
    folder:write("endless.lua", header .. [[
return rapid.study { name = "endless", frames = {1, 2}, repeat_runs = 1, sweep = { turns = {1, math.pi} },
  scene = function(k)
    while k.turns > 3 do end
    return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } } :solve {}
  end,
  reference = function() return { P = {{0, 0, 0}} } end }]])
    local found = json.decode(rapid("endless.lua --json -o out --script-timeout 0.5").stdout)
    assert.equal(0, found.rows[1].error)
    assert.truthy(found.rows[2].failed:find("the script ran for more than 0.5 s", 1, true), found.rows[2].failed)
  end)

  it("exits 2 where a scene can't be made", function()
    folder:write("misspelt.lua", header .. [[
return rapid.study { name = "misspelt", frames = {1, 2}, sweep = { substeps = {1} },
  scene = function(k)
    return rapid.create {} :solve { substep = k.substeps }
  end,
  reference = function() return { P = {} } end }]])
    local result = rapid "misspelt.lua -o out"
    assert.equal(2, result.status)
    local expected = 'misspelt.lua:4: node "solve1": unknown parameter "substep"'
    assert.truthy(result.stdout:find(expected, 1, true), result.stdout)
  end)
end)

describe("rapid study of a graph", function()
  folder:write("orbit.lua", header .. [[
return rapid.create { points = rapid.points.from { P = {{1, 0, 0}}, v = {{0, 0, -1}} } }
  :attract { strength = rapid.param("strength", 1) } :solve {}]])

  it("sweeps a parameter by the node's name or type, against itself", function()
    for _, node in ipairs { "solve", "solve1" } do
      local found, result = result_of(("orbit.lua --sweep %s.substeps=1,2,4,8 --reference 256 -f 1-49"):format(node))
      assert.equal(0, result.status)
      assert.same({ 1, 49 }, found.frames)
      assert.equal(256, found.reference[node .. ".substeps"])
      assert.near(2, found.lines[1].order, 0.05)
    end
  end)

  it("sweeps several, one of them for the lines", function()
    local found = result_of("orbit.lua --sweep solve.substeps=1,2 --sweep attract.strength=1,0 --repeat 1 " ..
      "--lines attract.strength --reference solve.substeps=64 -f 1-9 --error max --error-frames last --set strength=5")
    assert.same({ "attract.strength 1", "attract.strength 0" }, { found.lines[1].line, found.lines[2].line })
    assert.is_true(found.rows[1].error > 1e-6)
    assert.equal(0, found.rows[3].error) -- straight lines are exact
  end)

  it("takes the residual of constraints for the error: the largest of its frames, as --stats has them", function()
    folder:write("heap.lua", header .. [[
return rapid.create { points = rapid.points.grid { size = {0.6, 0.9, 0.3}, spacing = 0.3 } }
  :gravity {} :contact { radius = 0.16 } :collide { shape = rapid.shape.plane { offset = -1 }, bounce = 0 }
  :solve { substeps = rapid.param("n", 1) }]])
    local found, result = result_of "heap.lua --sweep solve.substeps=2,4 --error residual --repeat 1 -f 1-24"
    assert.equal(0, result.status)
    assert.equal("residual", found.error)
    for _, row in ipairs(found.rows) do
      local run = ("run heap.lua --set n=%d -f 1-24 --stats s.json"):format(row.knobs["solve.substeps"])
      assert.equal(0, command.rapid(run, { cwd = folder.path }).status)
      local worst = 0
      for i, frame in ipairs(json.decode(folder:read "s.json").frames) do
        if i > 1 then worst = math.max(worst, frame.constraint_residual_max) end
      end
      assert.is_true(worst > 1e-4)
      assert.near(worst, row.error, 1e-12)
    end
  end)

  it("sweeps a vector, in the parameter's own components", function()
    folder:write("fall.lua", header .. [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } } :gravity { name = "down" } :solve {}]])
    local found = result_of("fall.lua --sweep 'down.g={0,-8,0},{0,-6,0}' --reference '{0,-8,0}' -f 1-13 --error max")
    assert.same({ 0, -6, 0 }, found.rows[2].knobs["down.g"])
    assert.equal(0, found.rows[1].error)
    assert.near(2 * 0.5 ^ 2 / 2, found.rows[2].error, 1e-6) -- the difference of g, times t²/2
  end)

  it("distinguishes a setting that fails from one that the scene refuses", function()
    folder:write("warm.lua", header .. [[
return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }
  :points("warm", function(_, frame) if frame.number == 4 then error "hot" end end) :solve {}]])
    for sweep, status in pairs { ["1,2 -f 1-3"] = 0, ["1,2 -f 1-5"] = 1, ["1,-1 -f 1-3"] = 2 } do
      local result = rapid("warm.lua --repeat 1 -o out --reference 4 --sweep solve.substeps=" .. sweep)
      assert.equal(status, result.status, result.stdout)
    end
    local early = rapid "warm.lua --repeat 1 -o out --reference 4 --sweep solve.substeps=1,2 -f -4-3"
    assert.truthy(early.stdout:find("frames: -4 is before the scene's first frame, 1", 1, true), early.stdout)
  end)

  it("reports that there is no residual without a constraint", function()
    local result = rapid "orbit.lua --sweep solve.substeps=1,2 --error residual -f 1-3 -o out"
    assert.equal(1, result.status)
    assert.truthy(result.stdout:find("no constraint acts in the compared frames", 1, true), result.stdout)
  end)

  local function message(arguments, status)
    local result = rapid(arguments)
    assert.equal(status or 2, result.status, result.stdout)
    return result.stderr
  end

  it("reports mistakes before anything runs", function()
    assert.truthy(message("orbit.lua --sweep solev.substeps=1 --reference 2")
      :find('solev.substeps: the graph has no node "solev"; did you mean "solve"?', 1, true))
    assert.truthy(message("orbit.lua --sweep solve.substep=1 --reference 2")
      :find('orbit.lua:3: node "solve1": unknown parameter "substep"; did you mean "substeps"?', 1, true))
    assert.truthy(message("orbit.lua --sweep solve.substeps=1,2"):find("--reference is missing", 1, true))
    assert.truthy(message("orbit.lua --sweep solve.substeps=1,2 --error residual --reference 2")
      :find("--reference: a residual needs no reference; remove it", 1, true))
    assert.truthy(message("orbit.lua --sweep solve --reference 2"):find("it must be NODE.PARAM=VALUE", 1, true))
    assert.truthy(message("orbit.lua --sweep solve.substeps=1,1 --reference 2"):find("has the value 1 twice", 1, true))
    assert.truthy(message("orbit.lua --sweep solve.substeps=1,2 --sweep attract.core=0,1 --reference solve.substeps=2")
      :find("a line can vary only one of the knobs", 1, true))
    assert.truthy(message("orbit.lua --sweep solve.substeps=1,2 --reference 4 --repeat 999999999999")
      :find("--repeat = 999999999999; it must be at most 100000", 1, true))
    assert.truthy(message("orbit.lua"):find("the file returns no study", 1, true))
    assert.truthy(message("gone.lua --reference 5"):find("--reference needs --sweep", 1, true))
    assert.truthy(message("none.lua"):find("none.lua: No such file", 1, true))
  end)

  it("is told apart from a study, which other commands refuse", function()
    study "late.lua"
    for _, name in ipairs { "run", "check" } do
      local result = command.rapid(name .. " late.lua", { cwd = folder.path })
      assert.equal(2, result.status)
      assert.truthy(result.stderr:find("this is a study; run it with: rapid study late.lua", 1, true), result.stderr)
    end
  end)
end)

describe("rapid.study", function()
  local function message(fields)
    folder:write("wrong.lua", header .. ([[
local scene = function() return rapid.create {} :solve {} end
return rapid.study { %s }]]):format(fields))
    local result = rapid "wrong.lua -o out"
    assert.equal(2, result.status)
    return result.stderr
  end

  it("names the field that is wrong, its value and what would be right", function()
    local rest = 'scene = scene, frames = {1, 2}, sweep = { n = {1} }, reference = function() end, '
    for fields, expected in pairs {
      [rest] = "name = nil; it must be a string that is not empty",
      [rest .. 'name = "x", eror = "rms"'] = 'unknown field "eror"; did you mean "error"?',
      [rest .. 'name = "x", error = "mean"'] =
        'error = "mean"; it must be "rms", "max", "p95", "residual" or a function',
      [rest .. 'name = "x", error = "residual"'] =
        "reference = a function; it must be removed: a residual needs no reference",
      [rest .. 'name = "x", frames = {2, 1}'] = "frames = {2, 1}; the last must come after the first",
      [rest .. 'name = "x", sweep = { n = {{}} }'] = "sweep: n contains a table; values must be finite numbers,",
      [rest .. 'name = "x", repeat_runs = 0'] = "repeat_runs = 0; it must be a whole number, at least 1",
      [rest .. 'name = "x", error_frames = "first"'] = 'error_frames = "first"; it must be "all" or "last"',
      [rest .. 'name = "x", repeat_runs = 1e18'] = "it must be a whole number, at least 1 and at most 100000",
      [rest .. 'name = "x", lines = "m"'] = 'lines: the sweep has no knob "m"',
      [rest .. 'name = "x", lines = { "n", "n" }'] = 'lines: "n" appears twice; remove one',
      [rest .. 'name = "x", reference = { m = 1 }'] = 'reference: the sweep has no knob "m"',
    } do
      local found = message(fields)
      assert.truthy(found:find("wrong.lua", 1, true) and found:find(expected, 1, true), found)
    end
  end)
end)
