-- p:rand: numbers that depend only on seed, node, id and use.
local scene = require "testing.scene"

-- Returns 8,000 points whose attribute `r` is the value of an expression of p and frame, at frame 2.
local function drawn(expression, options, before)
  options = options or {}
  local text = [[
return rapid.create { points = rapid.points.grid { size = {20, 20, 20}, spacing = 1 }, seed = SEED }
  :attribute { r = 0 } BEFORE :points("NODE", function(p, frame) p.r = EXPRESSION end) :solve {}]]
  text = text:gsub("%u%u%u%u+", { SEED = options.seed or 7, NODE = options.node or "draw", EXPRESSION = expression,
    BEFORE = before or "" })
  local frame = options.frame or 2
  local points = scene.run(text, { frames = {frame, frame}, threads = options.threads })[frame]
  local numbers = {}
  for i = 1, #points do numbers[points[i].id] = points[i].r end
  return numbers, points
end

local function mean_of(numbers, f)
  local sum, count = 0, 0
  for id = 0, 7999 do sum, count = sum + f(numbers[id], id), count + 1 end
  return sum / count
end

local function correlation(a, b)
  local ma = mean_of(a, function(x) return x end)
  local mb = mean_of(b, function(x) return x end)
  local ab = mean_of(a, function(x, id) return (x - ma) * (b[id] - mb) end)
  local aa = mean_of(a, function(x) return (x - ma) ^ 2 end)
  local bb = mean_of(b, function(x) return (x - mb) ^ 2 end)
  return ab / math.sqrt(aa * bb)
end

describe("p:rand", function()
  it("is uniform in [0, 1)", function()
    local numbers, points = drawn "p:rand(1)"
    assert.truthy(points:min "r" >= 0)
    assert.truthy(points:max "r" < 1)
    -- For n = 8,000 uniform numbers: five standard errors, sqrt(1/12/n) of the mean and sqrt(1/180/n) of the variance.
    local mean = mean_of(numbers, function(x) return x end)
    assert.near(0.5, mean, 5 * math.sqrt(1 / 12 / 8000))
    assert.near(1 / 12, mean_of(numbers, function(x) return (x - mean) ^ 2 end), 5 * math.sqrt(1 / 180 / 8000))
    -- Ten bins, chi squared with 9 degrees of freedom: the probability of a value above 33.7 is 1 in 10,000.
    local bins, chi = {}, 0
    for id = 0, 7999 do
      local bin = math.floor(numbers[id] * 10)
      bins[bin] = (bins[bin] or 0) + 1
    end
    for bin = 0, 9 do chi = chi + (bins[bin] - 800) ^ 2 / 800 end
    assert.truthy(chi < 33.7, "chi squared is " .. chi)
  end)

  it("has more digits than a float keeps", function()
    -- The remainder of each number below 2^-32. If it were 0, numbers would have 32 bits.
    local _, points = drawn "(p:rand(1) * 2^32) % 1"
    assert.near(0.5, points:mean "r", 5 * math.sqrt(1 / 12 / 8000))
  end)

  it("is the same for the same seed, node, id and use: in each run, frame and number of threads", function()
    local numbers = drawn "p:rand(1)"
    assert.same(numbers, (drawn "p:rand(1)"))
    assert.same(numbers, (drawn("p:rand(1)", { frame = 4 })))
    assert.same(numbers, (drawn("p:rand(1)", { threads = 1 })))
    assert.same(numbers, (drawn("p:rand(1)", { threads = 7 })))
    assert.same(numbers, (drawn "p:rand(0.5 + 0.5)"))
    assert.same(numbers, (drawn "p:rand(2) and p:rand(1)"))
  end)

  it("is the same whatever was drawn before it", function()
    local numbers, of_frame = drawn "p:rand(1)", drawn "p:rand(1, frame)"
    assert.same(numbers, (drawn "p:rand(1, frame) * 0 + p:rand(1)"))
    assert.same(of_frame, (drawn "p:rand(1, 5) * 0 + p:rand(1) * 0 + p:rand(1, frame)"))
  end)

  it("is another for another use, seed, node or point", function()
    local numbers = drawn "p:rand(1)"
    -- Five standard errors of the correlation of independent numbers, 1/sqrt(n).
    local bound = 5 / math.sqrt(8000)
    for _, other in ipairs {
      drawn "p:rand(2)", drawn "p:rand(1.5)", drawn "p:rand(-1)", drawn "p:rand(0)", drawn("p:rand(1)", { seed = 8 }),
      drawn("p:rand(1)", { node = "other" }), drawn "p:rand(1, frame)", (drawn "p:rand(1, 1)"),
    } do
      assert.near(0, correlation(numbers, other), bound)
    end
    local shifted = {}
    for id = 0, 7999 do shifted[id] = numbers[(id + 1) % 8000] end
    assert.near(0, correlation(numbers, shifted), bound)
  end)

  it("is another each frame where it is given the frame, which counts as its number", function()
    local second, third = drawn("p:rand(1, frame)", { frame = 2 }), drawn("p:rand(1, frame)", { frame = 3 })
    assert.near(0, correlation(second, third), 5 / math.sqrt(8000))
    assert.same(second, (drawn("p:rand(1, frame.number)", { frame = 2 })))
    assert.near(0, correlation(drawn "p:rand(1, 0)", drawn "p:rand(1)"), 5 / math.sqrt(8000))
  end)

  it("does not change with a node that is inserted before", function()
    assert.same(drawn "p:rand(1)", (drawn("p:rand(1)", nil,
      ":points('inserted', function(p) p.v = p.v * p:rand(1) end) :gravity {}")))
  end)

  it("does not change with other points in the scene", function()
    local numbers = drawn "p:rand(1)"
    local with_dead = drawn("p:rand(1)", nil, ":delete { where = function(p) return p.id % 2 == 1 end }")
    for id = 0, 7998, 2 do assert.equal(numbers[id], with_dead[id]) end
    assert.is_nil(with_dead[1])
  end)

  it("is replaced by --seed", function()
    local text = [[
return rapid.create { points = two, seed = 1 }
  :points("k", function(p) p.v = vec3(p:rand(1), p:rand(2), 0) end) :solve {}]]
    local one = scene.run(text)
    assert.same_points(one[3], scene.run(text, { seed = 1 })[3])
    assert.not_equal(one[3][1].v.x, scene.run(text, { seed = 2 })[3][1].v.x)
  end)
end)
