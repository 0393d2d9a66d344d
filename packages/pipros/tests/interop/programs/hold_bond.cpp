// Holds a bond that stands on genuine bondcpp: `hold_bond ID wait|break`. It reads a line before it breaks it.
#include <bondcpp/bond.h>
#include <iostream>
int main(int argc, char** argv) {
  ros::init(argc, argv, "bond_in_cpp", ros::init_options::NoSigintHandler);
  ros::AsyncSpinner spinner(1);
  ros::NodeHandle node;
  spinner.start();
  bond::Bond bond("/bonds", argv[1]);
  bond.setConnectTimeout(60);
  bond.start();
  std::cout << "formed: " << bond.waitUntilFormed(ros::Duration(60)) << std::endl;
  if (std::string(argv[2]) == "break") {
    std::cin.get();
    bond.breakBond();
  }
  std::cout << "broken: " << bond.waitUntilBroken(ros::Duration(60)) << std::endl;
}
