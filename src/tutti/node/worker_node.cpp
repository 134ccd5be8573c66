// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/worker_node.hpp"

#include <utility>

#include "tutti/wire/codec.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::node {

void WorkerNode::one_by_one(std::size_t count, const std::function<void(std::size_t)>& call) {
  for (std::size_t i = 0; i < count; ++i) call(i);
}

WorkerNode::WorkerNode(bus::Endpoint self, std::shared_ptr<const server::ClosureFinder> finder,
                       std::shared_ptr<const SubmapFrames> submaps, ForEach for_each)
    : self_(self), finder_(std::move(finder)), submaps_(std::move(submaps)), for_each_(std::move(for_each)) {}

Result<ClosureVerdict> WorkerNode::verify(const SubmapPair& pair) const {
  const auto first = submaps_->submap(pair.first);
  if (!first) return tl::unexpected(first.error());
  const auto second = submaps_->submap(pair.second);
  if (!second) return tl::unexpected(second.error());
  auto verdict = finder_->verify(**first, **second, *submaps_);
  if (!verdict) return verdict;
  if (auto ok = wire::validate(*verdict); !ok) return tl::unexpected(ok.error());
  return verdict;
}

Step WorkerNode::receive(const bus::Envelope& envelope, Timestamp now) {
  Step step;
  const auto job = envelope.kind == bus::MessageKind::job
                       ? wire::decode_job(*envelope.bytes)
                       : fail(ErrorCode::invalid, "a {} to a worker", wire::name(envelope.kind));
  if (!job) {
    step.tell(now, MessageRefused{envelope.from, envelope.kind, job.error().message});
    return step;
  }
  std::vector<Result<ClosureVerdict>> results(job->pairs.size());
  for_each_(job->pairs.size(), [&](std::size_t i) { results[i] = verify(job->pairs[i]); });
  Verdicts answer{.job = job->id, .verdicts = {}, .failed = {}, .why = {}};
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i]) {
      answer.verdicts.push_back(std::move(*results[i]));
      continue;
    }
    if (answer.failed.empty()) answer.why = results[i].error().message.substr(0, wire::kMaxReasonBytes);
    answer.failed.push_back(job->pairs[i]);
  }
  step.messages.push_back({self_, bus::Endpoint::server(), bus::MessageKind::verdicts, job->id,
                           std::make_shared<const std::string>(wire::encode(answer))});
  return step;
}

}  // namespace tutti::node
