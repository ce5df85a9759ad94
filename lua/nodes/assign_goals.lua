-- assign_goals: points of one group are places for the others, which take one each; the places then go.
--
-- Whatever points can be born on is so a shape to go to: a surface, a volume, points of a file. At each frame points
-- that have no place yet get one of those that have come:
--
--   id         the k-th point by id the k-th place by id, and again from the first where places are fewer
--   random     the same with the places shuffled
--   nearest    by id the nearest place that is free; when all are taken, all are free again
local rapid = require "rapid"

local function by_id(a, b) return a.id < b.id end

-- Points are in the order of their ids, as a rule.
local function order_by_id(list)
  for k = 2, #list do
    if list[k].id < list[k - 1].id then return table.sort(list, by_id) end
  end
end

local function by_number(a, b)
  if a.number ~= b.number then return a.number < b.number end
  return a.id < b.id
end

-- Places that are free, in a tree of boxes: each node has a place, and the others on either side of it along an axis.
local function before(a, b, axis)
  local x, y = a.P[axis], b.P[axis]
  if x ~= y then return x < y end
  return a.id < b.id
end

-- Puts the element that belongs to place k there, smaller ones before it.
local function select(list, first, last, k, axis)
  while first < last do
    local pivot = list[math.floor((first + last) / 2)]
    local i, j = first, last
    while i <= j do
      while before(list[i], pivot, axis) do i = i + 1 end
      while before(pivot, list[j], axis) do j = j - 1 end
      if i <= j then
        list[i], list[j] = list[j], list[i]
        i, j = i + 1, j - 1
      end
    end
    if k <= j then last = j elseif k >= i then first = i else return end
  end
end

local function longest_axis(list, first, last)
  local low, high = list[first].P, list[first].P
  for k = first + 1, last do
    local P = list[k].P
    low = vec3(math.min(low.x, P.x), math.min(low.y, P.y), math.min(low.z, P.z))
    high = vec3(math.max(high.x, P.x), math.max(high.y, P.y), math.max(high.z, P.z))
  end
  local size = high - low
  return size.x >= size.y and size.x >= size.z and "x" or size.y >= size.z and "y" or "z"
end

local function build(nodes, list, first, last, parent)
  if first > last then return nil end
  local axis, middle = longest_axis(list, first, last), math.floor((first + last) / 2)
  select(list, first, last, middle, axis)
  local node = { place = list[middle], axis = axis, count = last - first + 1, free = last - first + 1, parent = parent }
  nodes[#nodes + 1] = node
  node.low = build(nodes, list, first, middle - 1, node)
  node.high = build(nodes, list, middle + 1, last, node)
  return node
end

-- best: { least, node }, the square of a distance.
local function search(node, P, best)
  if not node or node.free == 0 then return end
  if not node.taken then
    local way = node.place.P - P
    local d = way:dot(way)
    if d < best.least or d == best.least and node.place.id < best.node.place.id then best.least, best.node = d, node end
  end
  local off = P[node.axis] - node.place.P[node.axis]
  local near, far = node.low, node.high
  if off > 0 then near, far = far, near end
  search(near, P, best)
  if off * off <= best.least then search(far, P, best) end
end

-- The free place that is nearest, which is then taken.
local function take(nodes, P)
  local root, best = nodes[1], { least = math.huge }
  if root.free == 0 then
    for _, node in ipairs(nodes) do node.free, node.taken = node.count, false end
  end
  search(root, P, best)
  best.node.taken = true
  local node = best.node
  while node do
    node.free = node.free - 1
    node = node.parent
  end
  return best.node.place
end

return rapid.node {
  name = "assign_goals",
  doc  = "Gives points places to go to: the points of a group, which it removes.",
  params = {
    from = { "string", required = true, doc = "the group of the points that are places" },
    by   = { "string", default = "id", choices = { "id", "nearest", "random" }, doc = "who gets which" },
    into = { "group", default = "assigned", doc = "who has a place is put into this group" },
  },
  makes = { goal = {0, 0, 0} },
  detail = function(points, _, params)
    local places, takers = {}, {}
    for i = 1, #points do
      local p = points[i]
      if p:within(params.from) then
        places[#places + 1] = { P = p.P, id = p.id, number = p:rand(1) }
        p:kill()
      end
    end
    if #places == 0 then return end
    for i = 1, #points do
      local p = points[i]
      if not (p:within(params.from) or p:within(params.into)) then takers[#takers + 1] = { p = p, id = p.id } end
    end
    order_by_id(takers)
    order_by_id(places)
    if params.by == "random" then table.sort(places, by_number) end
    local tree = {}
    if params.by == "nearest" then build(tree, places, 1, #places) end
    for k, taker in ipairs(takers) do
      local place = tree[1] and take(tree, taker.p.P) or places[(k - 1) % #places + 1]
      taker.p.goal = place.P
      taker.p:join(params.into)
    end
  end,
}
