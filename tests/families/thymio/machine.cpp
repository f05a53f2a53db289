// Aseba's own compiler and virtual machine for programs of a Thymio, over standard input.
//
//     machine PROGRAM < COMMANDS
//
// It compiles PROGRAM and prints its words and the number of its variables, or the error of the compiler. Then it
// carries out a command a line: `put OFFSET VALUE`, `event NUMBER`, which runs the handler of an event to its end, and
// `get OFFSET COUNT`, which prints variables. It needs the Debian package aseba:
//
//     g++ machine.cpp -lasebacompiler -lasebacommon -lasebavm

#include <cstring>
#include <fstream>
#include <iostream>
#include <sstream>

#include <aseba/common/consts.h>
#include <aseba/common/msg/TargetDescription.h>
#include <aseba/compiler/compiler.h>
#include <aseba/vm/natives.h>
#include <aseba/vm/vm.h>

namespace {
const AsebaNativeFunctionDescription* const descriptions[] = {ASEBA_NATIVES_STD_DESCRIPTIONS};
const AsebaNativeFunctionPointer functions[] = {ASEBA_NATIVES_STD_FUNCTIONS};
std::wstring wide(const std::string& text) { return {text.begin(), text.end()}; }
} // namespace

extern "C" {
void AsebaNativeFunction(AsebaVMState* vm, uint16_t id) { functions[id](vm); }
void AsebaSendMessage(AsebaVMState*, uint16_t id, const void*, uint16_t) { std::cout << "message " << id << "\n"; }
void AsebaSendVariables(AsebaVMState*, uint16_t, uint16_t) {}
void AsebaSendDescription(AsebaVMState*) {}
void AsebaWriteBytecode(AsebaVMState*) {}
void AsebaResetIntoBootloader(AsebaVMState*) {}
void AsebaPutVmToSleep(AsebaVMState*) {}
void AsebaAssert(AsebaVMState*, int reason) { std::cout << "assertion " << reason << "\n"; std::exit(1); }
}

int main(int, char** words) {
    // what a robot has: `variable NAME SIZE` and `event NAME` on the first lines of the commands, until `program`
    Aseba::TargetDescription target;
    target.name = L"thymio-II";
    std::string word, name;
    while (std::cin >> word && word != "program") {
        unsigned size = 0;
        std::cin >> name;
        if (word == "variable") {
            std::cin >> size;
            target.namedVariables.emplace_back(wide(name), size);
        } else if (word == "event") {
            target.localEvents.push_back({wide(name), L""});
        } else if (word == "room") {
            target.bytecodeSize = std::stoi(name);
            std::cin >> target.variablesSize >> target.stackSize;
        }
    }
    for (const auto* each : descriptions) {
        Aseba::TargetDescription::NativeFunction function;
        function.name = wide(each->name);
        for (const auto* argument = each->arguments; argument->size; argument++)
            function.parameters.emplace_back(wide(argument->name), argument->size);
        target.nativeFunctions.push_back(function);
    }
    Aseba::Compiler compiler;
    Aseba::CommonDefinitions common;
    compiler.setTargetDescription(&target);
    compiler.setCommonDefinitions(&common);
    std::ifstream file(words[1]);
    std::stringstream text;
    text << file.rdbuf();
    std::wistringstream source(wide(text.str()));
    Aseba::BytecodeVector bytecode;
    Aseba::Error error;
    unsigned n_variables = 0;
    if (!compiler.compile(source, bytecode, n_variables, error)) {
        const std::wstring said = error.toWString();
        std::cout << "error " << std::string(said.begin(), said.end()) << "\n";
        return 1;
    }
    std::cout << n_variables << " " << bytecode.maxStackDepth;
    std::vector<uint16_t> program;
    for (const auto& each : bytecode) {
        program.push_back(each.bytecode);
        std::cout << " " << each.bytecode;
    }
    std::cout << "\n";

    std::vector<int16_t> variables(target.variablesSize), stack(target.stackSize);
    std::vector<uint16_t> memory(target.bytecodeSize);
    AsebaVMState vm{};
    vm.nodeId = 1;
    vm.bytecodeSize = memory.size();
    vm.bytecode = memory.data();
    vm.variablesSize = variables.size();
    vm.variables = variables.data();
    vm.stackSize = stack.size();
    vm.stack = stack.data();
    AsebaVMInit(&vm);
    std::copy(program.begin(), program.end(), memory.begin());
    int first = 0, second = 0;
    while (std::cin >> word >> first) {
        if (word == "event") {
            vm.flags = 0;
            AsebaVMSetupEvent(&vm, first);
            while (AsebaVMRun(&vm, 1000)) {}
        } else if (word == "put") {
            std::cin >> second;
            vm.variables[first] = second;
        } else {
            std::cin >> second;
            for (int k = 0; k < second; k++) std::cout << vm.variables[first + k] << " ";
            std::cout << "\n";
        }
    }
}
