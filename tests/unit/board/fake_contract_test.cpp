// The fake board of the Arduino face's tests against the contract: what those tests rely on is what
// every board does.
#include "tests/fake/fake_board.h"
#include "tests/unit/board/board_contract.h"

namespace qduino::board::contract::fake_contract_test {
namespace {

class FakeBench {
  public:
    FakeBench() { board_.state.wires = &wires_; }
    Board& board() { return board_; }
    const ContractWires& finish() { return wires_; }
    int current_core() { return board_.current_core(); }

  private:
    ContractWires wires_;
    fake::FakeBoard board_;
};

INSTANTIATE_TYPED_TEST_SUITE_P(Fake, BoardContract, FakeBench);

}  // namespace
}  // namespace qduino::board::contract::fake_contract_test
