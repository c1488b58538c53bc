// Channels of Ramulator 1 behind a C interface, in clocks of the command bus. Each burst is answered when its last
// command is issued, with the clock of its last data.

#include <deque>
#include <fstream>
#include <functional>
#include <iostream>
#include <list>
#include <map>
#include <vector>

// Ramulator's settings of scheduler, queues and refresh are constants of private members.
#define private public
#define protected public
#include "Controller.h"
#include "DDR4.h"
#include "LPDDR4.h"

using namespace ramulator;

bool ramulator::warmup_complete = false;

extern "C" struct PeerSettings {
  bool is_lpddr4;
  // `Scheduler<T>::Type`.
  int order;
  unsigned channels, queue, cap;
  // Clocks, as the fields of `Device`. DDR4 has Ramulator's own ones except `refi`. Without `burst`, LPDDR4 has its own
  // ones except `refi`, and `rfc` unless that is 0.
  int burst, cl, rcd, rp, ras, rtp, cwl, wr, wtr, ccd, rrd, faw, rfc, refi;
};

struct PeerCounts {
  uint64_t reads, writes, read_hits, hits, activates;
};

struct Peer {
  virtual ~Peer() {}
  virtual bool takes_write(uint64_t burst) = 0;
  virtual void request(uint64_t burst, bool write, int64_t clock, uint64_t number) = 0;
  virtual void advance(int64_t clock) = 0;
  virtual PeerCounts counts() = 0;
  std::deque<std::pair<uint64_t, int64_t>> answers;
};

template <typename T> struct Channels : Peer {
  T *spec;
  int write_latency;
  // Clocks that are done. Ramulator counts a clock at its beginning, so its clock is one ahead of ours.
  int64_t done = 0;
  // Reads that found the queue full, in order of arrival.
  struct Channel {
    Controller<T> *controller;
    std::deque<Request> waiting;
    uint64_t reads = 0, writes = 0;
  };
  std::vector<Channel> channels;

  Channels(T *spec, int write_latency, const PeerSettings &of) : spec(spec), write_latency(write_latency) {
    spec->set_channel_number(of.channels);
    spec->set_rank_number(1);
    spec->speed_entry.nREFI = of.refi;
    for (unsigned at = 0; at < of.channels; at++) {
      auto *channel = new DRAM<T>(spec, T::Level::Channel);
      channel->id = at;
      auto *controller = new Controller<T>(Config(), channel);
      controller->readq.max = controller->writeq.max = of.queue;
      controller->scheduler->cap = of.cap;
      controller->scheduler->type = typename Scheduler<T>::Type(of.order);
      channels.push_back({controller, {}});
    }
  }

  ~Channels() override {
    for (auto &channel : channels)
      delete channel.controller;
    delete spec;
  }

  // Row, bank, rank, column, channel, from the highest bit down: Ramulator's RoBaRaCoCh.
  std::vector<int> place(uint64_t burst) {
    const int *count = spec->org_entry.count;
    const int last = int(T::Level::Column);
    std::vector<int> place(last + 1);
    auto take = [&](uint64_t values) {
      auto value = burst % values;
      burst /= values;
      return int(value);
    };
    place[0] = take(count[0]);
    place[last] = take(count[last] / spec->prefetch_size);
    for (int level = 1; level < int(T::Level::Row); level++)
      place[level] = take(count[level]);
    place[int(T::Level::Row)] = int(burst);
    return place;
  }

  bool takes_write(uint64_t burst) override {
    auto &queue = channels[place(burst)[0]].controller->writeq;
    return queue.size() < queue.max;
  }

  void request(uint64_t burst, bool write, int64_t clock, uint64_t number) override {
    advance(clock);
    auto at = place(burst);
    auto &channel = channels[at[0]];
    auto type = write ? Request::Type::WRITE : Request::Type::READ;
    Request request(at, type, [](Request &) {});
    request.addr = long(number);
    if (write) {
      auto *controller = channel.controller;
      request.callback = [this, controller](Request &of) {
        answers.push_back({uint64_t(of.addr), controller->clk - 1 + write_latency});
      };
      channel.writes++;
      controller->enqueue(request);
    } else {
      channel.reads++;
      channel.waiting.push_back(request);
      admit(channel);
    }
  }

  void admit(Channel &channel) {
    while (!channel.waiting.empty() && channel.controller->enqueue(channel.waiting.front()))
      channel.waiting.pop_front();
  }

  void advance(int64_t clock) override {
    for (; done < clock; done++)
      for (auto &channel : channels) {
        auto *controller = channel.controller;
        auto &pending = controller->pending;
        auto before = pending.size();
        if (before && pending.front().depart <= controller->clk + 1)
          before--;
        controller->tick();
        if (pending.size() > before)
          answers.push_back({uint64_t(pending.back().addr), pending.back().depart - 1});
        admit(channel);
      }
  }

  PeerCounts counts() override {
    PeerCounts sum = {};
    for (auto &channel : channels) {
      auto *of = channel.controller;
      sum.reads += channel.reads;
      sum.writes += channel.writes;
      sum.read_hits += uint64_t(of->read_row_hits[0].value());
      sum.hits += uint64_t(of->row_hits.value());
      sum.activates += uint64_t(of->row_misses.value() + of->row_conflicts.value());
    }
    return sum;
  }
};

static Peer *lpddr4(const PeerSettings &of) {
  auto *spec = new LPDDR4("LPDDR4_8Gb_x16", "LPDDR4_3200");
  spec->channel_width = 16;
  auto &s = spec->speed_entry;
  if (of.burst) {
    s.nBL = of.burst, s.nCCD = of.ccd, s.nCL = of.cl, s.nRCD = of.rcd, s.nRPpb = s.nRPab = of.rp;
    s.nRAS = of.ras, s.nRC = of.ras + of.rp, s.nRTP = of.rtp, s.nCWL = of.cwl, s.nWR = of.wr;
    s.nRRD = of.rrd, s.nFAW = of.faw;
    // Ramulator adds a clock to the first, and the second to a turn from reads to writes.
    s.nWTR = of.wtr - 1, s.nDQSCK = 1, s.nPPD = 1;
    spec->read_latency = of.cl + of.burst;
  }
  if (of.rfc)
    s.nRFCab = of.rfc;
  for (auto &level : spec->timing)
    for (auto &command : level)
      command.clear();
  spec->init_timing();
  return new Channels<LPDDR4>(spec, s.nCWL + s.nBL, of);
}

static Peer *ddr4(const PeerSettings &of) {
  auto *spec = new DDR4("DDR4_4Gb_x8", "DDR4_2400R");
  return new Channels<DDR4>(spec, spec->speed_entry.nCWL + spec->speed_entry.nBL, of);
}

extern "C" {
Peer *peer_new(const PeerSettings *settings) { return settings->is_lpddr4 ? lpddr4(*settings) : ddr4(*settings); }
void peer_delete(Peer *peer) { delete peer; }
bool peer_takes_write(Peer *peer, uint64_t burst) { return peer->takes_write(burst); }
void peer_request(Peer *peer, uint64_t burst, bool write, int64_t clock, uint64_t number) {
  peer->request(burst, write, clock, number);
}
void peer_advance(Peer *peer, int64_t clock) { peer->advance(clock); }
bool peer_answer(Peer *peer, uint64_t *number, int64_t *clock) {
  if (peer->answers.empty())
    return false;
  *number = peer->answers.front().first;
  *clock = peer->answers.front().second;
  peer->answers.pop_front();
  return true;
}
void peer_counts(Peer *peer, PeerCounts *counts) { *counts = peer->counts(); }
}
