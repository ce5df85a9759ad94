-- The studies in graphs/studies: each runs, and proves the claims in its first lines.
local amount = require "tests.amount"
local command = require "testing.command"
local json = require "dkjson"

local folder = command.folder()

-- Returns the lines of a study by name, each with the errors of its rows, all of which ran.
local function lines_of(name)
  local result = command.rapid(("study graphs/studies/%s.lua --json --repeat 1 -o %s"):format(name, folder.path))
  assert.equal(0, result.status, result.stderr)
  local found, lines = json.decode(result.stdout), {}
  for _, line in ipairs(found.lines) do
    lines[line.line] = line
    line.errors = {}
  end
  for _, row in ipairs(found.rows) do table.insert(lines[row.line].errors, row.error) end
  return lines
end

local function falls(errors)
  for i = 2, #errors do assert.is_true(errors[i] < errors[i - 1], ("%g, then %g"):format(errors[i - 1], errors[i])) end
end

describe("the study", function()
  for _, name in ipairs { "ball", "floor" } do
    it(name .. " is exact by continuous, and by each other method converges, from further off", function()
      local lines = lines_of(name)
      assert.is_true(lines.continuous.at_rounding)
      for i, exact in ipairs(lines.continuous.errors) do
        assert.is_true(exact < lines.backtrack.errors[i] and lines.backtrack.errors[i] < lines.project.errors[i])
      end
      -- Whether a step ends next to a contact is chance, so the tolerance of the slope is large.
      assert.near(1, lines.project.order, 0.35)
      assert.near(2, lines.backtrack.order, 0.35)
    end)
  end

  it("emitter is of the orders 1, 2 and 3 by none, linear and spline", function()
    local lines = lines_of "emitter"
    for order, name in ipairs { "none", "linear", "spline" } do assert.near(order, lines[name].order, 0.05) end
  end)

  it("kepler is of second order by sub-steps, and better with less tolerance", function()
    local lines = lines_of "kepler"
    assert.near(2, lines.substeps.order, 0.05)
    falls(lines.tolerance.errors)
  end)

  it("stiff is exact at any stiffness", function()
    for name, line in pairs(lines_of "stiff") do assert.is_true(line.at_rounding, name) end
  end)

  it("orbit is of second order", function()
    assert.near(2, lines_of("orbit").orbit.order, 0.05)
  end)

  it("interact is of second order by sub-steps", function()
    assert.near(2, lines_of("interact").interact.order, 0.1)
  end)

  if amount.thorough then
    it("net is stretched less by sub-steps than by as many iterations, and by more of them", function()
      local lines = lines_of "net"
      local substeps, iterations = lines["sub-steps"].errors, lines.iterations.errors
      falls(substeps)
      for i, strain in ipairs(substeps) do
        assert.is_true(strain < iterations[i], ("%g and %g"):format(strain, iterations[i]))
      end
    end)
  end

  it("collapse overlaps less by sub-steps than by as many iterations, and by more of them", function()
    local lines = lines_of "collapse"
    local substeps, iterations = lines["sub-steps"].errors, lines.iterations.errors
    falls(substeps)
    assert.equal(substeps[1], iterations[1]) -- both eight substeps of one iteration
    for i = 2, #substeps do -- 16, 32, 64, 128 sweeps
      local most = iterations[i] / (({ [2] = 1, [3] = 3 })[i] or 10)
      assert.is_true(substeps[i] < most, ("%g and %g"):format(substeps[i], iterations[i]))
    end
  end)

  it("grids changes no bit by the number of grids", function()
    for _, line in pairs(lines_of "grids") do
      assert.equal(5, #line.errors)
      for _, off in ipairs(line.errors) do assert.equal(0, off) end
    end
  end)

  it("spring is exact as a node, and of second order as an action", function()
    local lines = lines_of "spring"
    assert.is_true(lines.node.at_rounding)
    assert.near(2, lines.action.order, 0.1)
  end)

  it("drag is exact as a node, of first order as an action, and no better by sub-steps as a kick", function()
    local lines = lines_of "drag"
    assert.is_true(lines.node.at_rounding)
    assert.near(1, lines.action.order, 0.1)
    assert.near(0, lines.kick.order, 0.01)
  end)

  it("turbulence is of second order by sub-steps, and better with less tolerance", function()
    local lines = lines_of "turbulence"
    assert.near(2, lines.substeps.order, 0.2)
    falls(lines.tolerance.errors)
  end)

  it("action is of second order by P and of first by v", function()
    local lines = lines_of "action"
    assert.near(2, lines["of P"].order, 0.05)
    assert.near(1, lines["of v"].order, 0.1)
  end)

  it("impacts is of second order under forces of the position, of first under forces of the velocity", function()
    local lines = lines_of "impacts"
    assert.near(2, lines.turbulence.order, 0.1)
    assert.near(1, lines.drag.order, 0.1)
    falls(lines.turbulence.errors)
    falls(lines.drag.errors)
  end)

  it("rods is of second order, whatever the masses", function()
    for ratio, line in pairs(lines_of "rods") do assert.near(2, line.order, 0.05, ratio) end
  end)

  it("subframes is of first order by sub-frames, and no better by sub-steps, which a script does not see", function()
    local lines = lines_of "subframes"
    assert.near(1, lines.subframes.order, 0.15)
    assert.near(0, lines.substeps.order, 0.01)
  end)

  it("is here for every file there is", function()
    local names = command.shell("cd graphs/studies && ls *.lua | tr '\\n' ' '").stdout
    assert.equal("action.lua ball.lua collapse.lua drag.lua emitter.lua floor.lua grids.lua impacts.lua " ..
      "interact.lua kepler.lua net.lua orbit.lua rods.lua spring.lua stiff.lua subframes.lua turbulence.lua ", names)
  end)
end)
