// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>

#include "tutti/geometry/pose3.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/agent_state/agent_state.hpp"
#include "tutti/wire/agent_state/internal/archive.hpp"
#include "tutti/wire/agent_state/internal/checks.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/payload.hpp"

namespace tutti::wire {
namespace {

using archive::pass, archive::Reader, archive::Writer, robot::AgentState;

template <class T>
std::string encode_part(T&& value) {
  v1::AgentState out;
  Writer writer(out);
  pass(writer, value);
  return pack_frame(MessageKind::agent_state, out.SerializeAsString());
}

/// Reads the numbers of a whole frame; none may be left over.
template <class T>
Status decode_part(std::string_view bytes, T& value) {
  const auto parsed = parse_frame<v1::AgentState>(MessageKind::agent_state, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  Reader reader(*parsed);
  pass(reader, value);
  if (!reader.is_complete()) return fail(ErrorCode::parse, "agent state: not as many numbers as its lengths say");
  return {};
}

constexpr const char* kHead = "head";
constexpr const char* kCorrections = "corrections";
constexpr std::string_view kChain = "chain/";
constexpr std::string_view kLink = "link/";
constexpr std::size_t kChainRow = 4096;  // keyframes at most

/// 8 bytes, most significant first: keys sort as numbers do.
std::string number_key(std::uint64_t number) {
  std::string key;
  for (int shift = 56; shift >= 0; shift -= 8) key.push_back(static_cast<char>((number >> shift) & 0xffU));
  return key;
}
std::string chain_key(std::size_t first) { return std::string(kChain) + number_key(first); }
std::string link_key(const consistency::Constraint& link) {
  return std::string(kLink) + number_key(link.from) + number_key(link.to);
}

/// Keyframes of a chain with what belongs to each: the first of all has no odometry, a representative one that of its
/// node.
struct ChainPart {
  std::uint64_t first = 0;
  std::vector<Keyframe> keyframes;
  std::vector<std::uint32_t> submap_of;
  std::vector<RelativePose> odometry;
  std::vector<RelativePose> node_odometry;
};
template <class A>
void pass(A& a, ChainPart& part) {
  pass(a, part.first);
  pass(a, part.keyframes);
  pass(a, part.submap_of);
  pass(a, part.odometry);
  pass(a, part.node_odometry);
}

/// A smoother without its chain and without what follows from the ledger.
struct Corrections {
  Pose3 first;
  std::vector<estimation::ChainConstraint> constraints;  ///< Where they are not the ledger's.
  bool are_ledgers = true;
  std::vector<Pose3> held;
  std::vector<Pose3> solution;
};
template <class A>
void pass(A& a, Corrections& corrections) {
  pass(a, corrections.first);
  pass(a, corrections.are_ledgers);
  pass(a, corrections.constraints);
  pass(a, corrections.held);
  pass(a, corrections.solution);
}

std::vector<estimation::ChainConstraint> constraints_of(const consistency::Ledger& ledger) {
  std::vector<estimation::ChainConstraint> out;
  for (const consistency::Constraint& c : ledger.constraints()) out.push_back({c.from, c.to, c.measurement});
  return out;
}

void put_chain(const robot::RobotAgent& agent, std::size_t from, StateRows& rows) {
  const LongList<Keyframe>& keyframes = agent.keyframes();
  const auto at = [](const auto& list, std::size_t index) { return list.begin() + static_cast<std::ptrdiff_t>(index); };
  const auto is_node = [](const Keyframe& keyframe) { return keyframe.representative; };
  // Nodes are counted from the end: the part that is new is short.
  std::size_t node = agent.node_odometry().size() -
                     static_cast<std::size_t>(std::ranges::count_if(at(keyframes, from), keyframes.end(), is_node));
  for (std::size_t first = from; first < keyframes.size(); first += kChainRow) {
    const std::size_t last = std::min(first + kChainRow, keyframes.size());
    ChainPart part{.first = first,
                   .keyframes = keyframes.part(first, last),
                   .submap_of = {at(agent.submap_of(), first), at(agent.submap_of(), last)},
                   .odometry = agent.smoother().odometry.part(std::max<std::size_t>(first, 1) - 1, last - 1),
                   .node_odometry = {}};
    const auto nodes = static_cast<std::size_t>(std::ranges::count_if(part.keyframes, is_node));
    part.node_odometry = agent.node_odometry().part(node, node + nodes);
    node += nodes;
    rows.emplace(chain_key(first), encode_part(part));
  }
}

/// Both are sorted by the stamps of the ends, of which there is one per pair.
void put_links(const std::vector<consistency::Constraint>& before, const std::vector<consistency::Constraint>& now,
               StateChange& change) {
  std::map<std::string, const consistency::Constraint*> old;
  for (const consistency::Constraint& link : before) old.emplace(link_key(link), &link);
  for (const consistency::Constraint& link : now) {
    const auto found = old.find(link_key(link));
    if (found == old.end() || !(*found->second == link))
      change.put.emplace(link_key(link), encode_part(consistency::Constraint(link)));
    if (found != old.end()) old.erase(found);
  }
  for (const auto& [key, link] : old) change.removed.push_back(key);
}

}  // namespace

std::string encode(const AgentState& state) { return encode_part(AgentState(state)); }

Result<AgentState> decode_agent_state(std::string_view bytes) {
  AgentState state;
  if (auto ok = decode_part(bytes, state); !ok) return tl::unexpected(ok.error());
  state.smoother.held = state.smoother.poses.size();
  if (state.smoother.poses.size() != state.smoother.odometry.size() + 1)
    return fail(ErrorCode::invalid, "agent state: its corrected poses are not those of its keyframes");
  if (const char* wrong = what_is_wrong(state)) return fail(ErrorCode::invalid, "agent state: {}", wrong);
  return state;
}

StateChange changed_rows(const robot::RobotAgent& agent, StoredState& stored) {
  StateChange change;
  AgentState head{agent.head(), {}, {}, {}, {}, {}};
  const std::uint64_t comparisons = head.comparisons;
  change.put.emplace(kHead, encode_part(head));
  put_chain(agent, stored.keyframes, change.put);
  const bool moved = !stored.has_corrections || stored.comparisons != comparisons;
  if (moved) {
    const estimation::SmootherState& smoother = agent.smoother();
    Corrections corrections{.first = smoother.first, .constraints = {}, .held = {}, .solution = smoother.solution};
    corrections.held = smoother.poses.part(0, smoother.held);
    corrections.are_ledgers = constraints_of(agent.ledger()) == smoother.constraints;
    if (!corrections.are_ledgers) corrections.constraints = smoother.constraints;
    change.put.emplace(kCorrections, encode_part(corrections));
    put_links(stored.links, agent.ledger().constraints(), change);
    stored.links = agent.ledger().constraints();
  }
  stored.keyframes = agent.keyframes().size();
  stored.comparisons = comparisons;
  stored.has_corrections = stored.keyframes > 0;  // the first of them sets the first pose
  return change;
}

StoredState stored_state(const AgentState& state) {
  return {state.keyframes.size(), state.comparisons, !state.keyframes.empty(), state.ledger.constraints()};
}

Result<AgentState> decode_state_rows(const StateRows& rows) {
  AgentState state;
  Corrections corrections;
  std::vector<consistency::Constraint> links;
  Status ok;
  const auto append = [](auto& to, const auto& from) {
    for (const auto& element : from) to.push_back(element);
  };
  const auto take = [&](const std::string& key, auto& value) {
    const auto found = rows.find(key);
    ok = found == rows.end() ? Status(fail(ErrorCode::invalid, "agent state: no row {}", key))
                             : decode_part(found->second, value);
    return ok.has_value();
  };
  if (!take(kHead, state) || !take(kCorrections, corrections)) return tl::unexpected(ok.error());
  for (auto row = rows.lower_bound(kChain); row != rows.end() && row->first.starts_with(kChain); ++row) {
    ChainPart part;
    if (ok = decode_part(row->second, part); !ok) return tl::unexpected(ok.error());
    if (part.first != state.keyframes.size() || row->first != chain_key(part.first))
      return fail(ErrorCode::invalid, "agent state: keyframes from {} on, expected from {}", part.first,
                  state.keyframes.size());
    append(state.keyframes, part.keyframes);
    append(state.submap_of, part.submap_of);
    append(state.smoother.odometry, part.odometry);
    append(state.node_odometry, part.node_odometry);
  }
  for (auto row = rows.lower_bound(kLink); row != rows.end() && row->first.starts_with(kLink); ++row) {
    links.emplace_back();
    if (ok = decode_part(row->second, links.back()); !ok) return tl::unexpected(ok.error());
  }
  state.ledger = consistency::Ledger(std::move(links));
  state.smoother.first = corrections.first;
  state.smoother.constraints =
      corrections.are_ledgers ? constraints_of(state.ledger) : std::move(corrections.constraints);
  state.smoother.held = corrections.held.size();
  state.smoother.poses = corrections.held;
  state.smoother.solution = std::move(corrections.solution);
  if (const char* wrong = what_is_wrong(state)) return fail(ErrorCode::invalid, "agent state: {}", wrong);
  return state;
}

std::string encode(const TrackedImages& images) {
  v1::AgentState out;
  Writer writer(out);
  TrackedImages copy = images;
  pass(writer, copy);
  return pack_frame(MessageKind::tracked_images, out.SerializeAsString());
}

Result<TrackedImages> decode_tracked_images(std::string_view bytes) {
  const auto parsed = parse_frame<v1::AgentState>(MessageKind::tracked_images, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  TrackedImages images;
  Reader reader(*parsed);
  pass(reader, images);
  if (!reader.is_complete()) return fail(ErrorCode::parse, "tracked images: not as many numbers as their lengths say");
  return images;
}

}  // namespace tutti::wire
