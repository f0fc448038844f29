// The simulated board against the contract: with wires that report their edges, and with wires that
// must be looked at.
#include "board/sim/sim_board.h"
#include "tests/unit/board/board_contract.h"

namespace qduino::board::contract::sim_contract_test {
namespace {

template <bool ReportsEdges>
class SimBench {
  public:
    Board& board() { return board_; }
    const ContractWires& finish() { return wires_; }
    int current_core() { return board_.current_core(); }

  private:
    ContractWires wires_{ReportsEdges};
    sim::SimBoard board_{sim::SimConfig{}, wires_};
};

INSTANTIATE_TYPED_TEST_SUITE_P(Sim, BoardContract, SimBench<false>);
INSTANTIATE_TYPED_TEST_SUITE_P(SimReportingEdges, BoardContract, SimBench<true>);

}  // namespace
}  // namespace qduino::board::contract::sim_contract_test
