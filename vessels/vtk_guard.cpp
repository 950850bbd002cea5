#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <vector>

#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"

namespace vstent::vessels {
namespace {

using Attributes = std::map<std::string, std::string, std::less<>>;

struct Tag {
  std::string name;
  Attributes attributes;
  bool closing = false;      // </name>
  bool self_closed = false;  // <name/>
  std::size_t text = 0;      // where what follows the tag begins
};

bool blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

std::optional<std::uint64_t> whole_number(std::string_view text) {
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  std::uint64_t value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

class VtpGuard {
 public:
  VtpGuard(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  void run() {
    check_start();
    std::vector<std::string> open;
    std::string section;
    int pieces = 0;
    while (std::optional<Tag> tag = next_tag()) {
      if (tag->closing) {
        if (open.empty() || open.back() != tag->name) refuse("</" + tag->name + "> closes nothing");
        open.pop_back();
        if (open.empty()) {
          ended_ = true;
          break;
        }
        continue;
      }
      if (open.empty()) check_root(*tag);
      if (open.size() == 1 && open[0] == "VTKFile" && tag->name == "AppendedData") {
        check_appended(*tag);
        break;
      }
      if (open.size() == 1 && tag->name != "PolyData")
        refuse("<" + tag->name + "> where <PolyData> belongs");
      if (tag->name == "Piece") {
        if (++pieces > 1) refuse("it has several pieces; merge them into one first");
        check_piece(*tag);
      }
      if (tag->name == "Array" || tag->name == "DataArray") {
        if (open.empty()) refuse("array outside PolyData");
        arrays_.push_back({open.back(), *tag});
      }
      if (open.size() > 40) refuse("elements are nested more than 40 deep");
      if (!tag->self_closed) open.push_back(tag->name);
    }
    if (!ended_) refuse("it ends before </VTKFile>: truncated");
    if (pieces == 0) refuse("it has no <Piece>: no geometry");
    for (const auto& [where, tag] : arrays_) check_array(where, tag);
    if (!has_points_) refuse("it has no point coordinates");
  }

 private:
  struct Found {
    std::string section;
    Tag tag;
  };

  [[noreturn]] void refuse(const std::string& why) const {
    throw Error(ExitCode::input_file, name_ + ": " + why);
  }

  std::string attribute(const Tag& tag, std::string_view key,
                        std::string_view otherwise = {}) const {
    const auto found = tag.attributes.find(key);
    return found == tag.attributes.end() ? std::string(otherwise) : found->second;
  }

  void check_start() {
    std::string_view start = bytes_.substr(0, 2048);
    if (start.substr(0, 3) == "\xEF\xBB\xBF") at_ = 3;
    while (at_ < start.size() && blank(start[at_])) ++at_;
    const std::string_view head = start.substr(at_);
    std::string lower(head.substr(0, 512));
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (lower.find("<html") != std::string::npos ||
        lower.find("<!doctype html") != std::string::npos) {
      refuse("it is a web page, not a VTK file");
    }
    if (head.substr(0, 14) == "# vtk DataFile") refuse("it is a legacy VTK file: name it .vtk");
    if (head.empty() || head.front() != '<') refuse("it is no XML file");
    if (start.find('\0') < start.find("<VTKFile")) refuse("it is not in UTF-8");
  }

  // The next element's tag from at_ on; comments and declarations are stepped over, entities
  // refused.
  std::optional<Tag> next_tag() {
    while (true) {
      const std::size_t open = bytes_.find('<', at_);
      if (open == std::string_view::npos) return std::nullopt;
      if (bytes_.substr(open, 4) == "<!--") {
        at_ = past("-->", open);
      } else if (bytes_.substr(open, 2) == "<?") {
        at_ = past("?>", open);
      } else if (bytes_.substr(open, 2) == "<!") {
        refuse("it declares a document type or entities, which VTK files never need");
      } else {
        return parse_tag(open + 1);
      }
    }
  }

  std::size_t past(std::string_view mark, std::size_t from) const {
    const std::size_t found = bytes_.find(mark, from);
    if (found == std::string_view::npos) refuse("it ends before </VTKFile>: truncated");
    return found + mark.size();
  }

  Tag parse_tag(std::size_t at) {
    Tag tag;
    const auto peek = [&]() -> char {
      if (at >= bytes_.size()) refuse("it ends before </VTKFile>: truncated");
      return bytes_[at];
    };
    if (peek() == '/') {
      tag.closing = true;
      ++at;
    }
    while (std::isalnum(static_cast<unsigned char>(peek())) != 0 || peek() == '_')
      tag.name += bytes_[at++];
    if (tag.name.empty()) refuse("it is no well-formed XML near byte " + std::to_string(at));
    while (true) {
      while (blank(peek())) ++at;
      if (peek() == '>') break;
      if (peek() == '/') {
        tag.self_closed = true;
        ++at;
        continue;
      }
      std::string key;
      while (peek() != '=' && !blank(peek()) && peek() != '>' && peek() != '/') key += bytes_[at++];
      while (blank(peek())) ++at;
      if (peek() != '=') refuse("it is no well-formed XML near byte " + std::to_string(at));
      ++at;
      while (blank(peek())) ++at;
      const char quote = peek();
      if (quote != '"' && quote != '\'')
        refuse("it is no well-formed XML near byte " + std::to_string(at));
      const std::size_t end = bytes_.find(quote, ++at);
      if (end == std::string_view::npos) refuse("it ends before </VTKFile>: truncated");
      tag.attributes[key] = std::string(bytes_.substr(at, end - at));
      at = end + 1;
    }
    tag.text = at_ = at + 1;
    return tag;
  }

  void check_root(const Tag& tag) {
    if (tag.name != "VTKFile") refuse("its root element is <" + tag.name + ">, not <VTKFile>");
    if (attribute(tag, "type") != "PolyData") {
      refuse("it holds " + attribute(tag, "type", "nothing named") +
             ", a surface must be PolyData");
    }
    const std::string order = attribute(tag, "byte_order", "LittleEndian");
    if (order != "LittleEndian" && order != "BigEndian")
      refuse("unknown byte_order \"" + order + "\"");
    little_endian_ = order == "LittleEndian";
    const std::string header = attribute(tag, "header_type", "UInt32");
    if (header != "UInt32" && header != "UInt64") refuse("unknown header_type \"" + header + "\"");
    header_bytes_ = header == "UInt32" ? 4 : 8;
    compressor_ = attribute(tag, "compressor");
    if (!compressor_.empty() && compressor_ != "vtkZLibDataCompressor" &&
        compressor_ != "vtkLZ4DataCompressor" && compressor_ != "vtkLZMADataCompressor") {
      refuse("unknown compressor \"" + compressor_ + "\"");
    }
  }

  // A number of items that a file of this size can hold: a byte each, or a thousandth (the best of
  // zlib) compressed.
  std::uint64_t count(const Tag& tag, std::string_view key) const {
    const std::string text = attribute(tag, key, "0");
    const std::optional<std::uint64_t> value = whole_number(text);
    if (!value) refuse(std::string(key) + "=\"" + text + "\" is not a count");
    const std::uint64_t most = bytes_.size() * (compressor_.empty() ? 1 : 1100);
    if (*value > most) {
      refuse(std::string(key) + "=\"" + text + "\" is more than a file of " +
             std::to_string(bytes_.size()) + " bytes can hold");
    }
    return *value;
  }

  void check_piece(const Tag& tag) {
    points_ = count(tag, "NumberOfPoints");
    verts_ = count(tag, "NumberOfVerts");
    lines_ = count(tag, "NumberOfLines");
    strips_ = count(tag, "NumberOfStrips");
    polys_ = count(tag, "NumberOfPolys");
    if (points_ == 0) refuse("it has no points");
  }

  void check_appended(const Tag& tag) {
    appended_base64_ = attribute(tag, "encoding", "base64") == "base64";
    const std::size_t mark = bytes_.find('_', tag.text);
    if (mark == std::string_view::npos) refuse("it ends before its appended data: truncated");
    appended_ = mark + 1;
    std::string_view tail = bytes_;
    while (!tail.empty() && (blank(tail.back()) || tail.back() == '\0')) tail.remove_suffix(1);
    ended_ = tail.ends_with("</VTKFile>");
  }

  void check_array(const std::string& section, const Tag& tag) {
    const std::string array = section + " array \"" + attribute(tag, "Name", "(unnamed)") + "\"";
    static const std::map<std::string, unsigned, std::less<>> kSizes = {
        {"Int8", 1},  {"UInt8", 1},  {"Int16", 2},   {"UInt16", 2},  {"Int32", 4},  {"UInt32", 4},
        {"Int64", 8}, {"UInt64", 8}, {"Float32", 4}, {"Float64", 8}, {"String", 0}, {"Bit", 0}};
    const std::string type = attribute(tag, "type");
    const auto size = kSizes.find(type);
    if (size == kSizes.end()) refuse(array + ": unknown type \"" + type + "\"");
    const std::string format = attribute(tag, "format", "ascii");
    if (format != "ascii" && format != "binary" && format != "appended") {
      refuse(array + ": unknown format \"" + format + "\"");
    }
    const std::optional<std::uint64_t> components =
        whole_number(attribute(tag, "NumberOfComponents", "1"));
    if (!components || *components < 1 || *components > 1000) {
      refuse(array + ": NumberOfComponents=\"" + attribute(tag, "NumberOfComponents") +
             "\" is not within 1 to 1000");
    }
    const std::optional<std::uint64_t> tuples = expected_tuples(section, attribute(tag, "Name"));
    if (section == "Points") {
      if (*components != 3)
        refuse("its points have " + std::to_string(*components) + " components, not 3");
      if (type != "Float32" && type != "Float64")
        refuse("its points are " + type + ", use Float32 or Float64");
      has_points_ = true;
    }
    if (section == "FieldData") count(tag, "NumberOfTuples");
    if (format == "appended" && appended_ == 0)
      refuse(array + " is appended, but there is no AppendedData");
    if (!tuples || size->second == 0) return;
    const std::uint64_t values = *tuples * *components;
    if (format == "ascii") {
      const std::uint64_t held = words(tag.text);
      if (held != values) mismatch(array, held, values, "values");
      return;
    }
    const std::optional<std::uint64_t> offset = whole_number(attribute(tag, "offset", "0"));
    if (!offset || (format == "appended" && *offset >= bytes_.size() - appended_)) {
      refuse(array + " begins beyond the end of the file: truncated");
    }
    const bool base64 = format == "binary" || appended_base64_;
    const std::size_t begin =
        format == "binary" ? tag.text : appended_ + static_cast<std::size_t>(*offset);
    const std::uint64_t held = payload_bytes(begin, base64, array);
    if (held != values * size->second) mismatch(array, held, values * size->second, "bytes");
  }

  [[noreturn]] void mismatch(const std::string& array, std::uint64_t held, std::uint64_t expected,
                             const std::string& what) const {
    refuse(array + " holds " + std::to_string(held) + " " + what + " where the header promises " +
           std::to_string(expected));
  }

  std::optional<std::uint64_t> expected_tuples(const std::string& section,
                                               const std::string& array) const {
    if (section == "Points" || section == "PointData") return points_;
    if (section == "CellData") return verts_ + lines_ + strips_ + polys_;
    if (array != "offsets") return std::nullopt;
    if (section == "Verts") return verts_;
    if (section == "Lines") return lines_;
    if (section == "Strips") return strips_;
    if (section == "Polys") return polys_;
    return std::nullopt;
  }

  std::uint64_t words(std::size_t at) const {
    std::uint64_t count = 0;
    bool inside = false;
    for (; at < bytes_.size() && bytes_[at] != '<'; ++at) {
      const bool gap = blank(bytes_[at]);
      if (!gap && !inside) ++count;
      inside = !gap;
    }
    return count;
  }

  // Uncompressed size of a data block, from its header: one length, or (blocks, block size, last
  // partial block).
  std::uint64_t payload_bytes(std::size_t begin, bool base64, const std::string& array) const {
    while (base64 && begin < bytes_.size() && blank(bytes_[begin])) ++begin;
    const std::size_t needed = header_bytes_ * (compressor_.empty() ? 1 : 3);
    const std::string head =
        base64 ? decode(begin, needed) : std::string(bytes_.substr(begin, needed));
    if (head.size() < needed) refuse(array + " ends within its header: truncated");
    std::array<std::uint64_t, 3> words{};
    for (std::size_t w = 0; w * header_bytes_ < needed; ++w) {
      for (std::size_t b = 0; b < header_bytes_; ++b) {
        const std::size_t from = w * header_bytes_ + (little_endian_ ? header_bytes_ - 1 - b : b);
        words[w] = (words[w] << 8) | static_cast<unsigned char>(head[from]);
      }
    }
    if (compressor_.empty()) return words[0];
    const auto [blocks, block, last] = words;
    if (blocks == 0) return 0;
    if (blocks > bytes_.size() || block > (std::uint64_t{1} << 40) || last > block) {
      refuse(array + " has an impossible compression header");
    }
    return last == 0 ? blocks * block : (blocks - 1) * block + last;
  }

  std::string decode(std::size_t at, std::size_t count) const {
    static constexpr std::string_view kAlphabet =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string result;
    std::uint32_t bits = 0;
    int held = 0;
    for (; at < bytes_.size() && result.size() < count; ++at) {
      const std::size_t digit = kAlphabet.find(bytes_[at]);
      if (digit == std::string_view::npos) break;
      bits = (bits << 6) | static_cast<std::uint32_t>(digit);
      held += 6;
      if (held >= 8) {
        held -= 8;
        result += static_cast<char>((bits >> held) & 0xFFU);
      }
    }
    return result;
  }

  std::string_view bytes_;
  std::string name_;
  std::size_t at_ = 0;
  bool ended_ = false, little_endian_ = true, appended_base64_ = true, has_points_ = false;
  std::size_t header_bytes_ = 4, appended_ = 0;
  std::string compressor_;
  std::uint64_t points_ = 0, verts_ = 0, lines_ = 0, strips_ = 0, polys_ = 0;
  std::vector<Found> arrays_;
};

}  // namespace

void guard_vtp(std::string_view bytes, const std::string& name) { VtpGuard(bytes, name).run(); }

void guard_legacy_vtk(std::string_view bytes, const std::string& name) {
  const auto refuse = [&](const std::string& why) {
    return Error(ExitCode::input_file, name + ": " + why);
  };
  std::size_t at = 0;
  const auto line = [&] {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    std::string_view result = bytes.substr(at, end - at);
    at = std::min(end + 1, bytes.size());
    while (!result.empty() && blank(result.back())) result.remove_suffix(1);
    return result;
  };
  const auto words = [](std::string_view text) {
    std::vector<std::string> result;
    for (std::size_t i = 0; i < text.size();) {
      while (i < text.size() && blank(text[i])) ++i;
      std::string word;
      while (i < text.size() && !blank(text[i])) word += text[i++];
      if (!word.empty()) result.push_back(std::move(word));
    }
    return result;
  };
  if (!line().starts_with("# vtk DataFile Version")) throw refuse("it is no legacy VTK file");
  line();  // title
  const std::vector<std::string> kind = words(line());
  const bool binary = kind.size() == 1 && kind[0] == "BINARY";
  if (!binary && !(kind.size() == 1 && kind[0] == "ASCII"))
    throw refuse("it says neither ASCII nor BINARY");
  std::vector<std::string> set = words(line());
  while (set.empty() && at < bytes.size()) set = words(line());
  if (set.size() != 2 || set[0] != "DATASET") throw refuse("it has no DATASET");
  if (set[1] != "POLYDATA")
    throw refuse("it holds " + set[1].substr(0, 40) + ", a surface must be POLYDATA");

  const auto count = [&](const std::string& word, const std::string& of) {
    const std::optional<std::uint64_t> value = whole_number(word);
    if (!value) throw refuse(of + " \"" + word.substr(0, 40) + "\" is not a count");
    if (*value > bytes.size()) {
      throw refuse(of + " " + word + " is more than a file of " + std::to_string(bytes.size()) +
                   " bytes can hold");
    }
    return static_cast<std::size_t>(*value);
  };
  const auto skip = [&](std::size_t size) {
    if (size > bytes.size() - at) throw refuse("it ends within its arrays: truncated");
    at += size;
  };
  bool points = false;
  while (at < bytes.size()) {
    const std::vector<std::string> head = words(line());
    if (head.empty()) continue;
    const std::string& key = head[0];
    if (key == "POINTS") {
      if (head.size() < 3) throw refuse("POINTS needs a count and a type");
      const std::size_t n = count(head[1], "POINTS");
      if (head[2] != "float" && head[2] != "double")
        throw refuse("its points are " + head[2].substr(0, 40));
      if (n == 0) throw refuse("it has no points");
      if (binary) skip(3 * n * (head[2] == "float" ? 4 : 8));
      points = true;
    } else if (key == "POLYGONS" || key == "LINES" || key == "VERTICES" ||
               key == "TRIANGLE_STRIPS") {
      if (head.size() < 3) throw refuse(key + " needs two counts");
      const std::size_t n = count(head[1], key);
      const std::size_t size = count(head[2], key);
      if (!binary) continue;
      const std::size_t before = at;
      const std::vector<std::string> offsets = words(line());
      if (offsets.size() == 2 && offsets[0] == "OFFSETS") {
        const auto width = [](const std::string& type) { return type.ends_with("64") ? 8U : 4U; };
        skip(n * width(offsets[1]));
        std::vector<std::string> ids = words(line());
        if (ids.empty()) ids = words(line());
        if (ids.size() != 2 || ids[0] != "CONNECTIVITY") throw refuse(key + " has no CONNECTIVITY");
        skip(size * width(ids[1]));
      } else {
        at = before;
        skip(4 * size);
      }
    } else if (key == "POINT_DATA" || key == "CELL_DATA") {
      if (head.size() >= 2) count(head[1], key);
      break;  // attribute sections are left to the child process and the array validation
    } else if (key == "FIELD" || key == "METADATA") {
      break;
    }
  }
  if (!points && at >= bytes.size()) throw refuse("it has no POINTS");
}

}  // namespace vstent::vessels
