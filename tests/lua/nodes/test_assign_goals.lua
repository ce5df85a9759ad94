-- :assign_goals: who gets which place.
local scene = require "testing.scene"

local function run(options, more)
  return scene.run(([[
local P, Q = {}, {}
for k = 1, 9 do P[k] = {k, 0, 0} end
for k = 1, 6 do Q[k] = {0, k, 0} end
return rapid.create { fps = 10 }
  :emit { source = rapid.points.from { P = P }, birth = "end", impulse = { [2] = 9, [4] = %d } }
  :emit { source = rapid.points.from { P = Q }, birth = "end", impulse = { [3] = 6, [6] = 2 },
           attributes = { target = 1 } }
  :group { name = "places", where = function(p) return p.target == 1 end }
  :assign_goals { from = "places", %s } :solve {}]]):format(more or 0, options), { frames = {1, 6} })
end

describe("assign_goals", function()
  it("gives places out by id, again from the first, and removes them", function()
    local result = run ""
    assert.equal(9, #result[2])
    for i = 1, 9 do assert.is_false(result[2][i]:within "assigned") end
    assert.equal(9, #result[3])
    local count = {}
    for i = 1, 9 do
      local p = result[5][i]
      assert.is_true(p:within "assigned")
      assert.near(result[5][(i - 1) % 6 + 1].goal, p.goal, 0)
      count[p.goal.y] = (count[p.goal.y] or 0) + 1
    end
    for k = 1, 6 do assert.is_true(count[k] ~= nil) end -- points are emitted from each place in turn
  end)

  it("shuffles them, each as often", function()
    local by_id, random = run ""[5], run "by = 'random'"[5]
    local moved, sum = 0, 0
    for i = 1, 6 do
      if random[i].goal.y ~= by_id[i].goal.y then moved = moved + 1 end
      sum = sum + 10 ^ random[i].goal.y
    end
    assert.is_true(moved > 0)
    assert.equal(1111110, sum)
  end)

  it("leaves alone who has a place, and who comes when there is none", function()
    local before, after = run "into = 'busy'"[3], run("into = 'busy'", 2)[5]
    assert.equal(11, #after)
    for i = 1, 9 do
      assert.near(before[i].goal, after[i].goal, 0)
      assert.is_true(after[i]:within "busy")
    end
    assert.is_false(after[10]:within "busy")
  end)

  it("gives places that come later to those who still have none", function()
    local result = run("", 2)
    for i = 1, 9 do assert.near(result[5][i].goal, result[6][i].goal, 0) end
    assert.equal(11, #result[6])
    assert.is_true(result[6][10]:within "assigned" and result[6][11]:within "assigned")
    assert.is_true(result[6][10].goal.y ~= result[6][11].goal.y)
  end)

  it("by nearest gives each by id the nearest place that is free, and all again when all are taken", function()
    local text = [[
return rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = %s } } :attribute { place = 0 }
  :points("spread", function(p, frame)
    if frame.number == 2 then p.P = vec3(p:rand(1), p:rand(2), p:rand(3)) p.place = p.id %% 3 == 0 and 1 or 0 end
  end) %s :solve {}]]
    local before = scene.run(text:format("0.14", ""), { frames = {2, 2} })[2]
    local after = scene.run(text:format("0.14", [[
      :group { name = "places", where = function(p) return p.place == 1 end }
      :assign_goals { from = "places", by = "nearest" }]]), { frames = {2, 2} })[2]
    local places, free = {}, {}
    for i = 1, #before do
      if before[i].place == 1 then places[#places + 1] = before[i] end
    end
    assert.truthy(#places > 50)
    assert.equal(#before - #places, #after)
    for i = 1, #after do
      if #free == 0 then free = { unpack(places) } end
      local best, least = 1, math.huge
      for k, place in ipairs(free) do
        local d = (place.P - after[i].P):length()
        if d < least then best, least = k, d end
      end
      assert.near(free[best].P, after[i].goal, 0)
      table.remove(free, best)
    end
  end)
end)
