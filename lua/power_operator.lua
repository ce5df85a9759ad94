-- Rewrites the operator ^ in scripts to calls of math.pow. LuaJIT's own operator calls the C library when it folds
-- constants and when it interprets, and replaces x^2 by x*x in compiled code.
--
--   -a.b ^ 2 ^ c      becomes      -(POWER(a.b,((POWER(2,(c))))))
--
-- The parentheses keep one value of each operand, and keep `return a ^ b` from being a tail call: LuaJIT compiles at
-- most fifteen tail calls in a trace.
--
-- The left operand is the simple expression before the operator. The right operand may start with unary operators and
-- includes any ^ that follows it. A function as an operand is left to LuaJIT, which raises the error.

-- An upward arrow: a valid name in LuaJIT that no script uses.
local name = "\226\134\145"

local keywords = {}
for word in ("and break do else elseif end false for function goto if in local nil not or repeat return then true "
  .. "until while"):gmatch "%a+" do
  keywords[word] = true
end

-- Returns the last byte of a quoted string that begins at `first`.
local function end_of_quoted(text, first)
  local quote, place = text:sub(first, first), first + 1
  while true do
    local found = text:find("[\\" .. quote .. "]", place)
    if text:sub(found, found) == quote then return found end
    place = found + 2
  end
end

-- Returns the last byte of a string in long brackets, or nil if none begins at `first`.
local function end_of_long(text, first)
  local level = text:match("^%[(=*)%[", first)
  return level and select(2, text:find("]" .. level .. "]", first, true))
end

-- Returns the last byte of a number. A sign belongs to it if it follows the letter of an exponent.
local function end_of_number(text, first)
  local exponent = text:find("^0[xX]", first) and "[pP]" or "[eE]"
  local place = first
  while true do
    place = select(2, text:find("^[%w_.\128-\255]*", place))
    if not (text:find("^" .. exponent, place) and text:find("^[+-]", place + 1)) then return place end
    place = place + 2
  end
end

local function end_of_operator(text, first)
  for _, operator in ipairs { "...", "..", "==", "~=", "<=", ">=", "::" } do
    if text:sub(first, first + #operator - 1) == operator then return first + #operator - 1 end
  end
  return first
end

-- Returns the tokens of a program without syntax errors: { kind, text, first, last }, where kind is "name", "string",
-- "value" (a number, nil, true, false or ...), or the text of a keyword or an operator.
local function tokens_of(text)
  local tokens, place = {}, text:find("^\239\187\191") and 4 or 1
  local function add(kind, last)
    local token = text:sub(place, last)
    tokens[#tokens + 1] = { kind = kind or token, text = token, first = place, last = last }
    place = last + 1
  end
  while true do
    place = text:find("%S", place)
    if not place then return tokens end
    if text:find("^%-%-", place) then
      place = (end_of_long(text, place + 2) or text:find("[\r\n]", place) or #text) + 1
    elseif text:find("^[%a_\128-\255]", place) then
      local last = select(2, text:find("^[%w_\128-\255]*", place))
      local word = text:sub(place, last)
      local is_value = word == "nil" or word == "true" or word == "false"
      add(is_value and "value" or not keywords[word] and "name" or nil, last)
    elseif text:find("^%.?%d", place) then
      add("value", end_of_number(text, place))
    elseif text:find("^[\"']", place) then
      add("string", end_of_quoted(text, place))
    elseif end_of_long(text, place) then
      add("string", end_of_long(text, place))
    else
      local last = end_of_operator(text, place)
      add(text:sub(place, last) == "..." and "value" or nil, last)
    end
  end
end

local closing = { ["("] = ")", ["["] = "]", ["{"] = "}" }
local opening = { [")"] = "(", ["]"] = "[", ["}"] = "{" }

-- Returns a map from the index of each bracket to that of its partner.
local function pairs_of_brackets(tokens)
  local other, open = {}, {}
  for place, token in ipairs(tokens) do
    if closing[token.kind] then
      open[#open + 1] = place
    elseif opening[token.kind] then
      other[place] = table.remove(open)
      other[other[place]] = place
    end
  end
  return other
end

-- Tokens that may be followed by a call's arguments or an index.
local is_end_of_prefix = { name = true, string = true, [")"] = true, ["]"] = true, ["}"] = true }

-- Returns the first token of the simple expression whose last token is at `place`, or nil if it is a function.
local function first_of_left(tokens, other, place)
  while true do
    local kind = tokens[place].kind
    if kind == "end" then return nil end
    place = other[place] or place
    local before = tokens[place - 1] and tokens[place - 1].kind
    if kind == "name" then
      if before ~= "." and before ~= ":" then return place end
      place = place - 2
    elseif kind ~= "value" and is_end_of_prefix[before] then
      place = place - 1
    else
      return place
    end
  end
end

local is_unary = { ["-"] = true, ["not"] = true, ["#"] = true }

-- Returns the last token of the operand that begins at `place`, or nil if it is a function.
local function last_of_right(tokens, other, place)
  while is_unary[tokens[place].kind] do place = place + 1 end
  local kind = tokens[place].kind
  if kind == "function" then return nil end
  local has_suffixes = kind == "name" or kind == "("
  place = other[place] or place
  local behind = tokens[place + 1] and tokens[place + 1].kind
  while has_suffixes do
    if behind == "." or behind == ":" then
      place = place + 2
    elseif behind == "string" then
      place = place + 1
    elseif closing[behind] then
      place = other[place + 1]
    else
      break
    end
    behind = tokens[place + 1] and tokens[place + 1].kind
  end
  if behind == "^" then return last_of_right(tokens, other, place + 2) end
  return place
end

local function with_calls(text)
  local tokens = tokens_of(text)
  local other = pairs_of_brackets(tokens)
  -- By index of tokens: operators that become calls; how many calls begin and end there.
  local calls, begun, ended = {}, {}, {}
  for place, token in ipairs(tokens) do
    local first = token.kind == "^" and first_of_left(tokens, other, place - 1)
    local last = first and last_of_right(tokens, other, place + 1)
    if last then
      calls[place] = true
      begun[first] = (begun[first] or 0) + 1
      ended[last] = (ended[last] or 0) + 1
    end
  end
  if not next(calls) then return nil end
  local parts, behind = {}, 1
  for place, token in ipairs(tokens) do
    parts[#parts + 1] = text:sub(behind, token.first - 1)
    parts[#parts + 1] = ("(" .. name .. "("):rep(begun[place] or 0)
    parts[#parts + 1] = calls[place] and ",(" or token.text
    parts[#parts + 1] = (")))"):rep(ended[place] or 0)
    behind = token.last + 1
  end
  parts[#parts + 1] = text:sub(behind)
  return table.concat(parts)
end

-- Returns the program with its operators ^ replaced by calls, or nil if it has none. Line numbers do not change. The
-- loops run once for a file, so they are interpreted and do not count as hot.
local function rewrite(text)
  if not text:find("^", 1, true) then return nil end
  local is_on = jit.status()
  jit.off()
  local rewritten = with_calls(text)
  if is_on then jit.on() end
  return rewritten
end
jit.off(rewrite)

return { name = name, rewrite = rewrite }
