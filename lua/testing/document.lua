-- Reads the documents of the checkout for their tests.
local document = {}

function document.read(path)
  local file = assert(io.open(path))
  local text = file:read "*a"
  file:close()
  return text
end

-- Returns the part of a text from a heading ("## rapid run") to the next one of its level or above.
function document.section(text, heading)
  local hashes = heading:match "^#+"
  local from = assert(text:find("\n" .. heading .. "\n", 1, true), "no section " .. heading)
  local to = #text
  local at = from + 1 + #heading
  while true do
    local found, _, level = text:find("\n(#+) ", at)
    if not found then break end
    if #level <= #hashes then to = found break end
    at = found + 1
  end
  return text:sub(from, to)
end

-- Iterates over the rows of all tables. Each is a list of the text of its cells.
function document.rows(text)
  return coroutine.wrap(function()
    for line in text:gmatch "[^\n]+" do
      local inner = line:match "^|(.*)|%s*$"
      if inner and not inner:match "^[%s|:-]*$" then
        local cells = {}
        for cell in (inner:gsub("\\|", "\1") .. "|"):gmatch "([^|]*)|" do
          cells[#cells + 1] = (cell:gsub("\1", "|"):gsub("^%s+", ""):gsub("%s+$", ""))
        end
        coroutine.yield(cells)
      end
    end
  end)
end

-- Returns the words in backticks, as a set.
function document.code(text)
  local words = {}
  for word in text:gmatch "`([^`]+)`" do words[word] = true end
  return words
end

-- Returns the blocks between ```LANGUAGE and ```.
function document.blocks(text, language)
  local blocks = {}
  for block in text:gmatch("\n```" .. language .. "\n(.-)\n```") do blocks[#blocks + 1] = block end
  return blocks
end

return document
