// The servers of serve_goals.py in C++ (`goals server`), and a client of them (`goals client`).
#include <actionlib/TestAction.h>
#include <actionlib/client/simple_action_client.h>
#include <actionlib/server/action_server.h>
#include <actionlib/server/simple_action_server.h>
#include <atomic>
#include <iostream>

typedef actionlib::SimpleActionServer<actionlib::TestAction> SimpleServer;
typedef actionlib::ActionServer<actionlib::TestAction> Server;
typedef actionlib::SimpleActionClient<actionlib::TestAction> Client;

actionlib::TestResult result(int number) {
  actionlib::TestResult made;
  made.result = number;
  return made;
}

int serve() {
  ros::NodeHandle node;
  boost::shared_ptr<SimpleServer> server;
  server.reset(new SimpleServer(node, "simple", [&](const actionlib::TestGoalConstPtr& goal) {
    if (goal->goal == 300) return;
    if (goal->goal == 200) {
      server->setAborted(result(0), "Exception in execute callback: by the goal");
      return;
    }
    while (goal->goal == 100 && !server->isPreemptRequested() && ros::ok()) {
      actionlib::TestFeedback feedback;
      feedback.feedback = goal->goal + 1;
      server->publishFeedback(feedback);
      ros::WallDuration(0.01).sleep();
    }
    if (server->isPreemptRequested())
      server->setPreempted(result(-1), "asked to end");
    else
      server->setSucceeded(result(goal->goal), "reached");
  }, false));
  server->start();
  Server full(node, "full", [](Server::GoalHandle handle) {
    if (handle.getGoal()->goal < 0) {
      handle.setRejected(result(-2), "not below zero");
    } else {
      handle.setAccepted();
      handle.setAborted(result(-3), "never");
    }
  }, [](Server::GoalHandle) {}, false);
  full.start();
  ros::spin();
  return 0;
}

int ask() {
  const ros::Duration forever(60);
  Client client("simple", true);
  auto show = [&] {
    std::cout << client.getState().toString() << " " << client.getResult()->result << " "
              << client.getState().getText() << std::endl;
  };
  std::cout << client.waitForServer(forever) << std::endl;
  actionlib::TestGoal goal;
  for (int number : {5, 200}) {
    goal.goal = number;
    client.sendGoalAndWait(goal, forever);
    show();
  }
  std::atomic<int> fed(0);
  goal.goal = 100;
  client.sendGoal(goal, Client::SimpleDoneCallback(), Client::SimpleActiveCallback(),
                  [&](const actionlib::TestFeedbackConstPtr& feedback) { fed = feedback->feedback; });
  while (!fed && ros::ok()) ros::WallDuration(0.01).sleep();
  std::cout << fed << std::endl;
  client.cancelGoal();
  std::cout << client.waitForResult(forever) << std::endl;
  show();
  goal.goal = 100;
  client.sendGoal(goal);
  goal.goal = 8;
  client.sendGoalAndWait(goal, forever);
  show();
  return 0;
}

int main(int argc, char** argv) {
  ros::init(argc, argv, std::string(argv[1]) + "_in_cpp");
  return std::string(argv[1]) == "server" ? serve() : ask();
}
